#include "demslam/config/slam_config.h"

#include "demslam/base/error.h"
#include "demslam/toml/toml.h"

namespace demslam {
namespace {

// Each structure names its fields once, for reading (TomlReader) and for writing (TomlWriter).

template <class Io, class O>
void frontend_fields(Io& io, O& o) {
  io.field("extractor", o.extractor);
  io.field("matcher", o.matcher);
  io.field("extractor_model", o.extractor_model);
  io.field("matcher_model", o.matcher_model);
  io.field("max_features", o.max_features);
  io.field("nearest_ratio", o.nearest_ratio);
  io.field("min_match_score", o.min_match_score);
  io.field("threads", o.threads);
  io.field("inference", o.inference);
}

template <class Io, class O>
void motion_fields(Io& io, O& o) {
  io.field("min_depth_m", o.min_depth_m);
  io.field("max_depth_m", o.max_depth_m);
  io.field("max_depth_baselines", o.max_depth_baselines);
  io.field("ransac_threshold_px", o.ransac_threshold_px);
  io.field("ransac_iterations", o.ransac_iterations);
  io.field("min_inliers", o.min_inliers);
  io.field("min_inlier_ratio", o.min_inlier_ratio);
  io.field("pixel_sigma_px", o.pixel_sigma_px);
  io.field("disparity_sigma_px", o.disparity_sigma_px);
  io.field("use_far_points", o.use_far_points);
  io.field("far_sigma_px", o.far_sigma_px);
  io.field("seed", o.seed);
}

template <class Io, class O>
void lost_fields(Io& io, O& o) {
  io.field("use_imu", o.use_imu);
  io.field("use_wheels", o.use_wheels);
  io.field("lost_sigma_m_per_s", o.lost_sigma_m_per_s);
  io.field("lost_sigma_deg_per_s", o.lost_sigma_deg_per_s);
  io.field("gyro_sigma_deg_per_s", o.gyro_sigma_deg_per_s);
  io.field("wheel_sigma", o.wheel_sigma);
  io.field("support_weak", o.support_weak);
}

template <class Io, class O>
void method_field(Io& io, O& method) {
  std::string word = to_string(method);
  io.field("method", word);
  if constexpr (Io::kReads) {
    const std::optional<OdometryMethod> known = odometry_method(word);
    if (!known) io.fail("method", "'method' must be \"pnp\", \"keyframe\" or \"window\"");
    method = *known;
  }
}

template <class Io, class O>
void self_calibration_fields(Io& io, O& o) {
  io.field("enabled", o.enabled);
  io.field("vergence_sigma_deg", o.vergence_sigma_deg);
  io.field("vergence_walk_deg_per_sqrt_km", o.vergence_walk_deg_per_sqrt_km);
}

template <class Io, class O>
void odometry_fields(Io& io, O& o) {
  method_field(io, o.method);
  io.field("window_keyframes", o.window_keyframes);
  motion_fields(io, o.motion);
  io.field("keyframe_min_overlap", o.keyframe_min_overlap);
  io.field("keyframe_max_distance_m", o.keyframe_max_distance_m);
  io.field("keyframe_max_rotation_deg", o.keyframe_max_rotation_deg);
  io.field("max_speed_m_per_s", o.max_speed_m_per_s);
  io.field("max_rotation_rate_deg_per_s", o.max_rotation_rate_deg_per_s);
  io.section("lost", [&](Io& section) { lost_fields(section, o.lost); });
  io.section("self_calibration", [&](Io& section) { self_calibration_fields(section, o.self_calibration); });
}

template <class Io, class O>
void loop_fields(Io& io, O& o) {
  io.field("radius_m", o.radius_m);
  io.field("max_radius_m", o.max_radius_m);
  io.field("min_path_m", o.min_path_m);
  io.field("max_heading_difference_deg", o.max_heading_difference_deg);
  io.field("max_candidates", o.max_candidates);
  io.field("min_inliers", o.min_inliers);
  io.field("gate", o.gate);
  io.field("sigma_floor_m", o.sigma_floor_m);
  io.field("sigma_floor_deg", o.sigma_floor_deg);
  io.field("confirming_keyframes", o.confirming_keyframes);
  io.field("confirming_path_m", o.confirming_path_m);
  io.field("confirming_radius_m", o.confirming_radius_m);
  io.field("agreement_gate", o.agreement_gate);
  io.field("spacing_m", o.spacing_m);
  io.field("appearance", o.appearance);
}

template <class Io, class O>
void patch_fields(Io& io, O& o) {
  io.field("length_m", o.length_m);
  io.field("cell_m", o.cell_m);
  io.field("min_points", o.min_points);
  io.field("gate_m", o.gate_m);
  io.field("gate_sigmas", o.gate_sigmas);
  io.field("sigma_relief_m", o.sigma_relief_m);
  io.field("min_cells", o.min_cells);
}

template <class Io, class O>
void patch_factor_fields(Io& io, O& o) {
  io.field("information_scale", o.information_scale);
  io.field("soft_sigmas", o.soft_sigmas);
  io.field("kernel_sigmas", o.kernel_sigmas);
}

template <class Io, class O>
void landmark_fields(Io& io, O& o) {
  io.field("min_depth_m", o.min_depth_m);
  io.field("max_depth_m", o.max_depth_m);
}

template <class Io, class O>
void acceptance_fields(Io& io, O& o) {
  io.field("peak_distance_m", o.peak_distance_m);
  io.field("peak_chi_square", o.peak_chi_square);
  io.field("max_misfit", o.max_misfit);
  io.field("max_noise_scale", o.max_noise_scale);
  io.field("min_cells", o.min_cells);
  io.field("max_sigma_m", o.max_sigma_m);
}

template <class Io, class O>
void submap_fields(Io& io, O& o) {
  io.field("recover", o.recover);
  io.field("factors", o.factors);
  io.field("length_m", o.length_m);
  io.field("every_m", o.every_m);
  io.field("disagree_m", o.disagree_m);
  io.field("step_m", o.step_m);
  io.field("min_window_m", o.min_window_m);
  io.field("max_window_m", o.max_window_m);
  io.field("window_sigmas", o.window_sigmas);
  io.field("min_window_deg", o.min_window_deg);
  io.field("max_window_deg", o.max_window_deg);
  io.field("sigma_tilt_deg", o.sigma_tilt_deg);
  io.section("acceptance", [&](Io& section) { acceptance_fields(section, o.acceptance); });
}

template <class Io, class O>
void anchoring_fields(Io& io, O& o) {
  io.field("height", o.height);
  io.field("spacing_m", o.spacing_m);
  io.field("sigma_dem_m", o.sigma_dem_m);
  io.field("dem_correlation_m", o.dem_correlation_m);
  io.field("alike_errors", o.alike_errors);
  io.field("filter_dem", o.filter_dem);
  io.field("estimate_noise", o.estimate_noise);
  io.field("sigma_bias_m", o.sigma_bias_m);
  io.field("sigma_shift_m", o.sigma_shift_m);
  io.field("vague_start_m", o.vague_start_m);
  io.field("sigma_contact_m", o.sigma_contact_m);
  io.field("normal", o.normal);
  io.field("sigma_normal_deg", o.sigma_normal_deg);
  io.field("kernel_sigmas", o.kernel_sigmas);
  io.field("full_gradient", o.full_gradient);
  io.field("gate", o.gate);
  io.field("max_tilt_deg", o.max_tilt_deg);
  io.field("patches", o.patches);
  io.section("patch", [&](Io& section) { patch_fields(section, o.patch); });
  io.section("patch_factor", [&](Io& section) { patch_factor_fields(section, o.patch_factor); });
  io.section("submap", [&](Io& section) { submap_fields(section, o.submap); });
}

template <class Io, class O>
void systematic_fields(Io& io, O& o) {
  io.field("enabled", o.enabled);
  io.field("scale_sigma", o.scale_sigma);
  io.field("rotation_sigma_deg_per_m", o.rotation_sigma_deg_per_m);
  io.field("stretch_m", o.stretch_m);
  io.field("scale_walk_per_sqrt_km", o.scale_walk_per_sqrt_km);
  io.field("rotation_walk_deg_per_m_per_sqrt_km", o.rotation_walk_deg_per_m_per_sqrt_km);
}

template <class Io, class O>
void graph_fields(Io& io, O& o) {
  io.field("loop_kernel_sigmas", o.loop_kernel_sigmas);
  io.field("loop_gate", o.loop_gate);
  io.field("window_m", o.window_m);
  io.field("batch_every", o.batch_every);
  io.field("batch_takes", o.batch_takes);
  io.field("max_iterations", o.max_iterations);
  io.section("systematic", [&](Io& section) { systematic_fields(section, o.systematic); });
}

template <class Io, class O>
void slam_fields(Io& io, O& o) {
  io.field("use_loops", o.use_loops);
  io.field("use_dem", o.use_dem);
  io.field("use_sun", o.use_sun);
  io.field("optimize_every_keyframes", o.optimize_every_keyframes);
  io.section("frontend", [&](Io& section) { frontend_fields(section, o.frontend); });
  io.section("odometry", [&](Io& section) { odometry_fields(section, o.odometry); });
  io.section("graph", [&](Io& section) { graph_fields(section, o.graph); });
  io.section("loops", [&](Io& section) { loop_fields(section, o.loops); });
  io.section("anchoring", [&](Io& section) { anchoring_fields(section, o.anchoring); });
  io.section("landmarks", [&](Io& section) { landmark_fields(section, o.landmarks); });
}

void check(const SlamOptions& o, const TomlReader& reader) {
  const auto require = [&](bool ok, const char* section, const char* what) {
    if (!ok) reader.fail(section, what);
  };
  require(o.frontend.max_features >= 50, "frontend", "frontend.max_features must be at least 50");
  require(o.frontend.threads >= 1, "frontend", "frontend.threads must be at least 1");
  require(o.odometry.motion.min_inliers >= 6, "odometry", "odometry.min_inliers must be at least 6");
  require(o.odometry.motion.pixel_sigma_px > 0.0 && o.odometry.motion.disparity_sigma_px > 0.0, "odometry",
          "odometry.pixel_sigma_px and disparity_sigma_px must be positive");
  require(o.odometry.self_calibration.vergence_sigma_deg > 0.0 &&
              o.odometry.self_calibration.vergence_walk_deg_per_sqrt_km >= 0.0,
          "odometry.self_calibration",
          "odometry.self_calibration.vergence_sigma_deg must be positive (enabled = false switches it off)");
  require(o.odometry.motion.max_depth_m > o.odometry.motion.min_depth_m && o.odometry.motion.min_depth_m > 0.0,
          "odometry", "odometry.min_depth_m must be positive and below max_depth_m");
}

}  // namespace

SlamOptions read_slam_config(const std::filesystem::path& file) {
  TomlReader reader = TomlReader::from_file(file);
  SlamOptions options;
  slam_fields(reader, options);
  reader.reject_unknown();
  check(options, reader);
  return options;
}

std::string to_toml(const SlamOptions& options) {
  TomlWriter writer;
  slam_fields(writer, options);
  return writer.text();
}

}  // namespace demslam
