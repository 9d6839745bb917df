#pragma once

#include <array>
#include <sstream>
#include <string>
#include <utility>

#include "demslam/sim/scene.h"

namespace demslam {

/// A name for each value of an enumeration, as scene files spell it.
template <class Enum, std::size_t N>
using EnumNames = std::array<std::pair<Enum, const char*>, N>;

inline constexpr EnumNames<Relief, 4> kReliefNames{
    {{Relief::flat, "flat"}, {Relief::mare, "mare"}, {Relief::mid, "mid"}, {Relief::highland, "highland"}}};
inline constexpr EnumNames<Photometry, 3> kPhotometryNames{
    {{Photometry::lambert, "lambert"}, {Photometry::lunar_lambert, "lunar_lambert"}, {Photometry::hapke, "hapke"}}};
inline constexpr EnumNames<Soil, 3> kSoilNames{
    {{Soil::regolith, "regolith"}, {Soil::mare, "mare"}, {Soil::highland, "highland"}}};
inline constexpr EnumNames<Lens, 2> kLensNames{{{Lens::pinhole, "pinhole"}, {Lens::fisheye, "fisheye"}}};
inline constexpr EnumNames<RouteKind, 6> kRouteNames{{{RouteKind::straight, "straight"},
                                                      {RouteKind::loop, "loop"},
                                                      {RouteKind::waypoints, "waypoints"},
                                                      {RouteKind::planned, "planned"},
                                                      {RouteKind::legs, "legs"},
                                                      {RouteKind::recorded, "recorded"}}};

/// A field that is an enumeration inside and a word in the file.
template <class Io, class Enum, std::size_t N>
void enum_field(Io& io, const char* key, Enum& value, const EnumNames<Enum, N>& names) {
  std::string word, known;
  for (const auto& [each, name] : names) {
    if (each == value) word = name;
    known += std::string(known.empty() ? "" : ", ") + "\"" + name + "\"";
  }
  io.field(key, word);
  if constexpr (Io::kReads) {
    for (const auto& [each, name] : names) {
      if (word == name) return void(value = each);
    }
    io.fail(key, std::string("'") + key + "' must be one of " + known);
  }
}

/// A number with the range it must lie in; the error points at the line.
template <class Io, class T>
void bounded(Io& io, const char* key, T& value, double low, double high) {
  io.field(key, value);
  if constexpr (Io::kReads) {
    if (value >= low && value <= high) return;
    std::ostringstream message;
    message << "'" << key << "' is " << value << ", it must lie between " << low << " and " << high;
    io.fail(key, message.str());
  }
}

template <class Io, class O>
void terrain_fields(Io& io, O& terrain) {
  io.field("dem", terrain.dem);
  enum_field(io, "relief", terrain.relief, kReliefNames);
  bounded(io, "size_m", terrain.size_m, 20.0, 20000.0);
  bounded(io, "hurst", terrain.hurst, 0.3, 1.0);
  bounded(io, "roughness", terrain.roughness, 0.0, 10.0);
  bounded(io, "albedo_variation", terrain.albedo_variation, 0.0, 0.3);
  bounded(io, "crater_density", terrain.crater_density, 0.0, 3.0);
  bounded(io, "rock_abundance", terrain.rock_abundance, 0.0, 0.3);
  bounded(io, "rock_max_m", terrain.rock_max_m, 0.05, 10.0);
  bounded(io, "rock_clearance_m", terrain.rock_clearance_m, 0.0, 10.0);
  io.field("continue_dem", terrain.continue_dem);
  io.field("placed_craters", terrain.placed_craters);
  if constexpr (Io::kReads) {
    for (const auto& crater : terrain.placed_craters) {
      if (crater.z() <= 0.0) io.fail("placed_craters", "'placed_craters' are [x, y, diameter] with a diameter above 0");
    }
  }
  io.field("tracks", terrain.tracks);
}

template <class Io, class O>
void light_fields(Io& io, O& light) {
  io.field("sun_elevation_deg", light.sun_elevation_deg);
  if constexpr (Io::kReads) {
    if (light.sun_elevation_deg <= 0.0 || light.sun_elevation_deg > 90.0) {
      io.fail("sun_elevation_deg",
              "'sun_elevation_deg': the sun is below the horizon; it must be above 0 and at most 90");
    }
  }
  bounded(io, "sun_azimuth_deg", light.sun_azimuth_deg, -360.0, 360.0);
  enum_field(io, "photometry", light.photometry, kPhotometryNames);
  bounded(io, "albedo", light.albedo, 0.01, 1.0);
  bounded(io, "sun_diameter_deg", light.sun_diameter_deg, 0.0, 10.0);
  bounded(io, "fill", light.fill, 0.0, 10.0);
  bounded(io, "lamp", light.lamp, 0.0, 1e6);
  enum_field(io, "soil", light.soil, kSoilNames);
  bounded(io, "earthshine", light.earthshine, 0.0, 1000.0);
  bounded(io, "earth_elevation_deg", light.earth_elevation_deg, 0.0, 90.0);
  bounded(io, "earth_azimuth_deg", light.earth_azimuth_deg, -360.0, 360.0);
  io.field("utc", light.utc);
  bounded(io, "longitude_deg", light.longitude_deg, -180.0, 360.0);
  bounded(io, "latitude_deg", light.latitude_deg, -90.0, 90.0);
}

template <class Io, class O>
void camera_fields(Io& io, O& camera) {
  bounded(io, "width_px", camera.width_px, 16, 8192);
  bounded(io, "height_px", camera.height_px, 16, 8192);
  bounded(io, "horizontal_fov_deg", camera.horizontal_fov_deg, 5.0, 150.0);
  bounded(io, "baseline_m", camera.baseline_m, 0.001, 10.0);
  bounded(io, "forward_m", camera.forward_m, -20.0, 20.0);
  bounded(io, "height_m", camera.height_m, 0.2, 20.0);
  bounded(io, "pitch_down_deg", camera.pitch_down_deg, -89.0, 89.0);
  bounded(io, "exposure", camera.exposure, 0.0, 1e6);
  bounded(io, "gamma", camera.gamma, 1.0, 4.0);
  bounded(io, "full_well_e", camera.full_well_e, 0.0, 1e7);
  bounded(io, "read_noise_e", camera.read_noise_e, 0.0, 1e5);
  bounded(io, "blur_px", camera.blur_px, 0.0, 10.0);
  bounded(io, "samples_per_axis", camera.samples_per_axis, 1, 8);
  io.field("smooth_edges", camera.smooth_edges);
  bounded(io, "vignetting", camera.vignetting, 0.0, 1.0);
  io.field("distortion", camera.distortion);
  if constexpr (Io::kReads) {
    const std::size_t count = camera.distortion.size();
    if (count != 0 && count != 4 && count != 5)
      io.fail("distortion", "'distortion' needs k1, k2, p1, p2 and perhaps k3, of a fisheye k1, k2, k3, k4");
  }
  enum_field(io, "lens", camera.lens, kLensNames);
  io.field("bits", camera.bits);
  if constexpr (Io::kReads) {
    if (camera.bits != 8 && camera.bits != 10 && camera.bits != 12) io.fail("bits", "'bits' must be 8, 10 or 12");
  }
  bounded(io, "exposure_time_s", camera.exposure_time_s, 0.0, 10.0);
  bounded(io, "readout_time_s", camera.readout_time_s, 0.0, 1.0);
  bounded(io, "exposure_memory_s", camera.exposure_memory_s, 0.0, 1000.0);
  bounded(io, "dust_spots", camera.dust_spots, 0, 1000);
  bounded(io, "flare", camera.flare, 0.0, 100.0);
}

template <class Io, class O>
void rover_fields(Io& io, O& rover) {
  enum_field(io, "route", rover.route, kRouteNames);
  io.field("start_m", rover.start_m);
  bounded(io, "heading_deg", rover.heading_deg, -360.0, 360.0);
  bounded(io, "length_m", rover.length_m, 0.1, 200000.0);
  io.field("waypoints_m", rover.waypoints_m);
  if constexpr (Io::kReads) {
    const bool through_points =
        rover.route == RouteKind::waypoints || rover.route == RouteKind::planned || rover.route == RouteKind::legs;
    if (through_points && rover.waypoints_m.size() < 2) {
      io.fail("waypoints_m", "this route needs at least two points in 'waypoints_m'");
    }
  }
  bounded(io, "speed_m_per_s", rover.speed_m_per_s, 0.001, 100.0);
  bounded(io, "frame_rate_hz", rover.frame_rate_hz, 0.001, 1000.0);
  bounded(io, "wheelbase_m", rover.wheelbase_m, 0.1, 10.0);
  bounded(io, "track_m", rover.track_m, 0.1, 10.0);
  bounded(io, "stop_after_m", rover.stop_after_m, 0.0, 200000.0);
  io.field("recording", rover.recording);
  if constexpr (Io::kReads) {
    if (rover.route == RouteKind::recorded && rover.recording.empty()) {
      io.fail("route", "route = \"recorded\" needs a trajectory file in 'recording'");
    }
  }
  bounded(io, "stop_every_m", rover.stop_every_m, 0.0, 200000.0);
  bounded(io, "stop_s", rover.stop_s, 0.0, 1e6);
  bounded(io, "turn_rate_deg_per_s", rover.turn_rate_deg_per_s, 0.1, 360.0);
  bounded(io, "max_turn_rate_deg_per_s", rover.max_turn_rate_deg_per_s, 0.1, 360.0);
  bounded(io, "wheels", rover.wheels, 4, 6);
  bounded(io, "slip_percent_per_deg", rover.slip_percent_per_deg, 0.0, 10.0);
}

template <class Io, class O>
void dem_product_fields(Io& io, O& product) {
  bounded(io, "cell_m", product.cell_m, 0.1, 1000.0);
  bounded(io, "noise_rms_m", product.noise_rms_m, 0.0, 1000.0);
  bounded(io, "correlation_m", product.correlation_m, 0.001, 10000.0);
  io.field("bias_m", product.bias_m);
  io.field("shift_m", product.shift_m);
  bounded(io, "margin_m", product.margin_m, 0.0, 20000.0);
  bounded(io, "track_spacing_m", product.track_spacing_m, 0.0, 10000.0);
}

template <class Io, class O>
void start_fields(Io& io, O& start) {
  io.field("error_m", start.error_m);
  io.field("heading_error_deg", start.heading_error_deg);
  bounded(io, "sigma_position_m", start.sigma_position_m, 1e-6, 1e6);
  bounded(io, "sigma_rotation_deg", start.sigma_rotation_deg, 1e-6, 360.0);
}

template <class Io, class O>
void calibration_error_fields(Io& io, O& error) {
  bounded(io, "baseline_m", error.baseline_m, -1.0, 1.0);
  bounded(io, "focal_px", error.focal_px, -1000.0, 1000.0);
  bounded(io, "row_offset_px", error.row_offset_px, -100.0, 100.0);
  io.field("rotation_deg", error.rotation_deg);
}

template <class Io, class O>
void output_fields(Io& io, O& output) {
  io.field("depth", output.depth);
  io.field("labels", output.labels);
  io.field("lidar", output.lidar);
  io.field("imu", output.imu);
  io.field("wheels", output.wheels);
  io.field("sun", output.sun);
  io.field("normals", output.normals);
  io.field("images", output.images);
}

/// Lists every field of a scene once, for reading and for writing.
template <class Io, class O>
void scene_fields(Io& io, O& scene) {
  io.field("seed", scene.seed);
  io.section("terrain", [&](Io& section) { terrain_fields(section, scene.terrain); });
  io.section("light", [&](Io& section) { light_fields(section, scene.light); });
  io.section("camera", [&](Io& section) { camera_fields(section, scene.camera); });
  io.section("rover", [&](Io& section) { rover_fields(section, scene.rover); });
  io.section("dem_product", [&](Io& section) { dem_product_fields(section, scene.dem_product); });
  io.section("start", [&](Io& section) { start_fields(section, scene.start); });
  io.section("calibration_error", [&](Io& section) { calibration_error_fields(section, scene.calibration_error); });
  io.section("output", [&](Io& section) { output_fields(section, scene.output); });
}

}  // namespace demslam
