#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace demslam {

enum class Relief { flat, mare, mid, highland };
enum class Photometry { lambert, lunar_lambert, hapke };
enum class Soil { regolith, mare, highland };
enum class Lens { pinhole, fisheye };
enum class RouteKind { straight, loop, waypoints, planned, legs, recorded };

/// The rendered ground: a base surface (a DEM file, or generated), and everything finer than it, which is always
/// generated.
struct TerrainOptions {
  std::filesystem::path dem;         ///< empty: the base is generated
  Relief relief = Relief::highland;  ///< amplitude of the generated relief, fine relief included
  double size_m = 500.0;             ///< side of a generated base, centred on the map's origin
  double hurst = 0.9;                ///< fractal exponent: the amplitude of a wavelength L grows as L^hurst
  double roughness = 1.0;            ///< multiplies the relief's fractal amplitude
  double albedo_variation = 0.04;    ///< relative RMS of the ground's albedo, for each of four scales
  double crater_density = 1.0;       ///< 1: the equilibrium population, N(>D) = 0.079 D^-2 per square metre
  double rock_abundance = 0.03;      ///< area fraction covered by rocks (Golombek's k); 0: none
  double rock_max_m = 1.5;           ///< largest diameter
  double rock_clearance_m = 0.9;     ///< no rock higher than the rover's belly is closer to its route
  bool continue_dem = true;  ///< amplitude and exponent of the relief below a DEM as measured on it; else the relief's
  std::vector<Eigen::Vector3d> placed_craters;  ///< fresh craters at a chosen place: x, y, rim diameter, metres
  bool tracks = true;                           ///< the rover's wheels leave ruts
};

struct LightOptions {
  double sun_elevation_deg = 25.0;
  double sun_azimuth_deg = 60.0;  ///< from East towards North, as the heading; light comes from there
  Photometry photometry = Photometry::hapke;
  double albedo = 0.12;            ///< normal albedo of the regolith
  double sun_diameter_deg = 0.53;  ///< width of the penumbra; 0: a point
  double fill = 1.0;  ///< strength of the light that the sunlit ground throws into shadows; 1: as it is, 0: none
  double lamp = 0.0;  ///< headlamp beside and below the cameras: its light at 1 m, relative to the sun's; 0: none
  Soil soil = Soil::regolith;  ///< which parameters photometry = "hapke" takes (photometry.h)
  double earthshine = 0.0;     ///< light of the Earth, 1: of a full one, 1.0e-4 of the sun's; 0: none
  double earth_elevation_deg = 45.0, earth_azimuth_deg = 0.0;
  std::string utc;  ///< 2026-11-25T12:00:00Z: the sun stands where it then is (sun_ephemeris.h); empty: as said above
  double longitude_deg = 0.0, latitude_deg = 0.0;  ///< of the map's origin on the Moon, where the DEM does not say it
};

struct CameraOptions {
  int width_px = 1024, height_px = 1024;
  double horizontal_fov_deg = 90.0;  ///< focal length = width / 2 / tan(fov / 2); principal point in the image's middle
  double baseline_m = 0.31;
  double forward_m = 1.0;  ///< left camera in the body: this far ahead of the ground contact point,
  double height_m = 1.5;   ///< this high, and half a baseline to the left
  double pitch_down_deg = 20.0;
  double exposure = 0.0;  ///< grey value per unit of reflected radiance (I/F); 0: from the first frame, then kept
  double gamma = 2.0;     ///< grey = 255 (exposed radiance)^(1/gamma); 2 is the square-root table of flight cameras
  double full_well_e = 12000.0;    ///< electrons at white, sets the photon noise
  double read_noise_e = 12.0;      ///< electrons; with full_well_e = 0 there is no noise
  double blur_px = 0.5;            ///< sigma of the point-spread function; 0: none
  int samples_per_axis = 1;        ///< n x n rays per pixel
  bool smooth_edges = true;        ///< with one ray per pixel: four more where pixels differ, as a sensor's area would
  double vignetting = 0.1;         ///< loss of light in the corners, falling off with the square of the distance
  std::vector<double> distortion;  ///< radtan k1, k2, p1, p2[, k3] of both cameras, fisheye k1..k4; empty: none
  Lens lens = Lens::pinhole;       ///< fisheye: equidistant, focal length = width / 2 / (fov / 2 in radians)
  int bits = 8;                    ///< 8, 10 or 12; more than 8 are written as the upper bits of 16-bit images
  double exposure_time_s = 0.0;    ///< the image is the mean over it (motion blur, six times the work); 0: an instant
  double readout_time_s = 0.0;     ///< rolling shutter, from the first row to the last; the stamp is the middle row's
  double exposure_memory_s = 0.0;  ///< automatic exposure follows the scene with this time constant; 0: never changes
  int dust_spots = 0;              ///< on each camera's window
  double flare = 0.0;  ///< stray light of a sun in front of the camera: veil and ghosts; 1: a fair lens, 0: none
};

struct RoverOptions {
  RouteKind route = RouteKind::straight;
  Eigen::Vector2d start_m = Eigen::Vector2d::Zero();  ///< map position of the first pose (straight, loop)
  double heading_deg = 0.0;                           ///< of the first pose, from East towards North
  double length_m = 150.0;                            ///< driven distance; a loop closes after it and goes 3 % further
  /// "waypoints": a smooth curve through them; "planned": around steep slopes and rocks; "legs": straight from one to
  /// the next, turning on the spot.
  std::vector<Eigen::Vector2d> waypoints_m;
  double speed_m_per_s = 0.5;
  double frame_rate_hz = 1.0;                ///< frames are speed_m_per_s / frame_rate_hz apart
  double wheelbase_m = 1.2, track_m = 1.0;   ///< contact points around the body's origin
  double stop_after_m = 0.0;                 ///< the route ends after this distance; 0: at its last point
  std::filesystem::path recording;           ///< for route = "recorded": the places of a TUM trajectory (map frame)
  double stop_every_m = 0.0, stop_s = 10.0;  ///< stands still for stop_s after every stop_every_m; 0: never
  double turn_rate_deg_per_s = 10.0;         ///< of turns on the spot
  double max_turn_rate_deg_per_s = 30.0;     ///< in bends, where the rover slows down for it
  int wheels = 4;                            ///< 4 or 6 (the middle pair between the others) carry the body
  double slip_percent_per_deg = 0.3;         ///< wheels turn more than the rover advances, per degree uphill

  /// Frames `spacing_m` apart, by the frame rate: the rover drives as fast as before.
  void space_frames(double spacing_m) { frame_rate_hz = speed_m_per_s / spacing_m; }
};

/// The elevation map that the mission has: the rendered ground as an orbiter would have measured it.
struct DemProductOptions {
  double cell_m = 5.0;
  double noise_rms_m = 0.5;
  double correlation_m = 10.0;  ///< the noise's autocorrelation is exp(-(d / L)^2)
  double bias_m = 0.0;
  Eigen::Vector2d shift_m = Eigen::Vector2d::Zero();  ///< the product shows the ground of (x, y) at (x, y) + shift
  double margin_m = 250.0;                            ///< around the route, as far as the base surface goes
  double track_spacing_m =
      0.0;  ///< mean distance of North-South altimeter tracks, linear in between (as LOLA); 0: no gaps
};

/// What the mission believes of the first pose, and how far that is from the truth.
struct StartOptions {
  Eigen::Vector3d error_m = Eigen::Vector3d::Zero();  ///< added to the true position, map frame
  double heading_error_deg = 0.0;
  double sigma_position_m = 0.1;
  double sigma_rotation_deg = 0.1;
};

/// What the calibration file says wrongly, as truth plus error: the images keep the true geometry.
struct CalibrationErrorOptions {
  double baseline_m = 0.0;
  double focal_px = 0.0;
  double row_offset_px = 0.0;                              ///< of the right camera's cy
  Eigen::Vector3d rotation_deg = Eigen::Vector3d::Zero();  ///< of the right camera about its axes
};

struct OutputOptions {
  bool depth = true;     ///< image0/depth/*.pfm
  bool labels = false;   ///< image0/label/*.png: 0 sky, 1 regolith, 2 crater, 3 rock
  bool lidar = false;    ///< LiDAR/*.txt
  bool imu = false;      ///< imu.txt
  bool wheels = false;   ///< wheels.txt
  bool sun = false;      ///< sun.csv: a sun sensor of 0.5 degrees and the ephemeris's direction, at every frame
  bool normals = false;  ///< image0/normal/*.pfm: unit normals, map frame
  bool images = true;    ///< false: no frames (images, depth, labels, LiDAR); they are rendered when they are read
};

/// A whole simulated mission. The defaults are a valid scene; a file changes single values (scene_fields.h lists them).
struct SceneOptions {
  std::uint64_t seed = 1;
  TerrainOptions terrain;
  LightOptions light;
  CameraOptions camera;
  RoverOptions rover;
  DemProductOptions dem_product;
  StartOptions start;
  CalibrationErrorOptions calibration_error;
  OutputOptions output;
};

/// Reads a scene TOML. Throws Error with file and line: unknown key, wrong type, value out of range, sun below the
/// horizon. A relative terrain.dem is taken relative to the file's folder.
SceneOptions read_scene(const std::filesystem::path& file);

/// The effective scene, every field; reads back to the same options.
std::string scene_toml(const SceneOptions& scene);

/// Throws Error when a value is out of range; `source` names the scene in the message.
void check_scene(const SceneOptions& scene, const std::string& source);

}  // namespace demslam
