#pragma once

#include <array>
#include <string>
#include <utility>

#include "demslam/sim/scene.h"

namespace demslam {

/// A name for each value of an enumeration, as scene files spell it.
template <class Enum, std::size_t N>
using EnumNames = std::array<std::pair<Enum, const char*>, N>;

inline constexpr EnumNames<Relief, 4> kReliefNames{
    {{Relief::flat, "flat"}, {Relief::mare, "mare"}, {Relief::mid, "mid"}, {Relief::highland, "highland"}}};
inline constexpr EnumNames<Photometry, 3> kPhotometryNames{{{Photometry::lambert, "lambert"},
                                                            {Photometry::lunar_lambert, "lunar_lambert"},
                                                            {Photometry::hapke, "hapke"}}};
inline constexpr EnumNames<RouteKind, 3> kRouteNames{
    {{RouteKind::straight, "straight"}, {RouteKind::loop, "loop"}, {RouteKind::waypoints, "waypoints"}}};

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
  io.section("output", [&](Io& section) { section.field("depth", scene.output.depth); });
}

template <class Io, class O>
void terrain_fields(Io& io, O& terrain) {
  io.field("dem", terrain.dem);
  enum_field(io, "relief", terrain.relief, kReliefNames);
  io.field("size_m", terrain.size_m);
  io.field("hurst", terrain.hurst);
  io.field("roughness", terrain.roughness);
  io.field("crater_density", terrain.crater_density);
  io.field("rock_abundance", terrain.rock_abundance);
  io.field("rock_max_m", terrain.rock_max_m);
  io.field("rock_clearance_m", terrain.rock_clearance_m);
}

template <class Io, class O>
void light_fields(Io& io, O& light) {
  io.field("sun_elevation_deg", light.sun_elevation_deg);
  io.field("sun_azimuth_deg", light.sun_azimuth_deg);
  enum_field(io, "photometry", light.photometry, kPhotometryNames);
  io.field("albedo", light.albedo);
}

template <class Io, class O>
void camera_fields(Io& io, O& camera) {
  io.field("width_px", camera.width_px);
  io.field("height_px", camera.height_px);
  io.field("horizontal_fov_deg", camera.horizontal_fov_deg);
  io.field("baseline_m", camera.baseline_m);
  io.field("forward_m", camera.forward_m);
  io.field("height_m", camera.height_m);
  io.field("pitch_down_deg", camera.pitch_down_deg);
  io.field("exposure", camera.exposure);
  io.field("gamma", camera.gamma);
  io.field("full_well_e", camera.full_well_e);
  io.field("read_noise_e", camera.read_noise_e);
  io.field("blur_px", camera.blur_px);
  io.field("samples_per_axis", camera.samples_per_axis);
}

template <class Io, class O>
void rover_fields(Io& io, O& rover) {
  enum_field(io, "route", rover.route, kRouteNames);
  io.field("start_m", rover.start_m);
  io.field("heading_deg", rover.heading_deg);
  io.field("length_m", rover.length_m);
  io.field("waypoints_m", rover.waypoints_m);
  io.field("speed_m_per_s", rover.speed_m_per_s);
  io.field("frame_rate_hz", rover.frame_rate_hz);
  io.field("wheelbase_m", rover.wheelbase_m);
  io.field("track_m", rover.track_m);
}

template <class Io, class O>
void dem_product_fields(Io& io, O& product) {
  io.field("cell_m", product.cell_m);
  io.field("noise_rms_m", product.noise_rms_m);
  io.field("correlation_m", product.correlation_m);
  io.field("bias_m", product.bias_m);
  io.field("shift_m", product.shift_m);
  io.field("margin_m", product.margin_m);
}

template <class Io, class O>
void start_fields(Io& io, O& start) {
  io.field("error_m", start.error_m);
  io.field("heading_error_deg", start.heading_error_deg);
  io.field("sigma_position_m", start.sigma_position_m);
  io.field("sigma_rotation_deg", start.sigma_rotation_deg);
}

}  // namespace demslam
