#include "demslam/report/internal/run_json.h"

#include <cmath>
#include <functional>
#include <limits>

#include "demslam/base/error.h"
#include "demslam/base/text.h"
#include "demslam/geometry/covariance.h"
#include "demslam/report/internal/distance_axis.h"
#include "demslam/report/internal/packed.h"
#include "demslam/report/internal/residual_json.h"
#include "demslam/report/internal/run_map.h"
#include "demslam/report/internal/view_json.h"

namespace demslam {
namespace {

using Json = nlohmann::ordered_json;

/// A column of one value per row.
template <class Row, class Value>
Column column(const std::string& name, const std::vector<Row>& rows, const Value& value) {
  Column result{name, {}};
  for (const Row& row : rows) result.values.push_back(static_cast<float>(value(row)));
  return result;
}

Columns track(const Trajectory& trajectory) {
  const auto axis = [&](const char* name, int k) {
    return column(name, trajectory, [k](const StampedPose& p) { return p.pose.translation()[k]; });
  };
  return {axis("x_m", 0), axis("y_m", 1), axis("z_m", 2)};
}

Columns frame_columns(const ReportRun& run, const DistanceAxis& distance) {
  const auto of_frame = [&](const char* name, auto value) { return column(name, run.frames, value); };
  Columns columns = {of_frame("distance_m", [&](const FrameLine& f) { return distance.at(f.t_ns); }),
                     of_frame("keypoints", [](const FrameLine& f) { return f.keypoints; }),
                     of_frame("stereo_points", [](const FrameLine& f) { return f.stereo_points; }),
                     of_frame("matches", [](const FrameLine& f) { return f.matches; }),
                     of_frame("inliers", [](const FrameLine& f) { return f.inliers; }),
                     of_frame("rms_px", [](const FrameLine& f) { return f.rms_px; })};
  for (Column timing : run.timings) {
    timing.values.resize(run.frames.size(), std::numeric_limits<float>::quiet_NaN());
    columns.push_back(std::move(timing));
  }
  return columns;
}

Columns error_columns(const Evaluation& evaluation) {
  const auto of_error = [&](const char* name, auto value) { return column(name, evaluation.errors, value); };
  return {of_error("distance_m", [](const PoseError& e) { return e.distance_m; }),
          of_error("horizontal_m", [](const PoseError& e) { return e.error_m.head<2>().norm(); }),
          of_error("vertical_m", [](const PoseError& e) { return e.error_m.z(); }),
          of_error("position_m", [](const PoseError& e) { return e.error_m.norm(); })};
}

/// Of the position, map axes, square metres; NaN where the run wrote none.
std::vector<Eigen::Matrix3d> position_covariances(const ReportRun& run, const std::vector<KeyframePose>& keyframes) {
  std::vector<Eigen::Matrix3d> result;
  for (const KeyframePose& keyframe : keyframes) {
    const auto it = std::lower_bound(run.covariances.begin(), run.covariances.end(), keyframe.t_ns,
                                     [](const StampedCovariance& c, TimestampNs t) { return c.t_ns < t; });
    if (it == run.covariances.end() || it->t_ns != keyframe.t_ns) {
      result.push_back(Eigen::Matrix3d::Constant(std::numeric_limits<double>::quiet_NaN()));
      continue;
    }
    result.push_back(position_covariance(keyframe.T_map_body, it->covariance));
  }
  return result;
}

Columns keyframe_columns(const ReportRun& run, const std::vector<KeyframePose>& keyframes,
                         const DistanceAxis& distance) {
  const TimestampNs start = run.frames.empty() ? 0 : run.frames.front().t_ns;
  const auto of = [&](const char* name, auto value) { return column(name, keyframes, value); };
  Columns columns = {of("distance_m", [&](const KeyframePose& k) { return distance.at(k.t_ns); }),
                     of("number", [](const KeyframePose& k) { return k.number; }),
                     of("frame", [](const KeyframePose& k) { return k.frame; }),
                     of("time_s", [&](const KeyframePose& k) { return to_seconds(k.t_ns - start); }),
                     of("x_m", [](const KeyframePose& k) { return k.T_map_body.translation().x(); }),
                     of("y_m", [](const KeyframePose& k) { return k.T_map_body.translation().y(); }),
                     of("z_m", [](const KeyframePose& k) { return k.T_map_body.translation().z(); }),
                     of("heading_rad", [](const KeyframePose& k) { return yaw_of(k.T_map_body.rotation()); })};
  const auto covariances = position_covariances(run, keyframes);
  for (const auto& [name, row, col] :
       {std::tuple{"cov_xx_m2", 0, 0}, {"cov_xy_m2", 0, 1}, {"cov_yy_m2", 1, 1}, {"cov_zz_m2", 2, 2}}) {
    columns.push_back(column(name, covariances, [r = row, c = col](const Eigen::Matrix3d& m) { return m(r, c); }));
  }
  return columns;
}

Json loops_json(const ReportRun& run, const std::vector<KeyframePose>& keyframes, const DistanceAxis& distance) {
  std::map<std::size_t, const KeyframePose*> by_number;
  for (const KeyframePose& keyframe : keyframes) by_number[keyframe.number] = &keyframe;
  Json loops = Json::array();
  for (const FrameLine& frame : run.frames) {
    if (!frame.loop) continue;
    Json loop = {{"frame", frame.index},
                 {"distance_m", distance.at(frame.t_ns)},
                 {"status", frame.loop->status},
                 {"inliers", frame.loop->inliers}};
    if (!frame.loop->reason.empty()) loop["reason"] = frame.loop->reason;
    if (frame.keyframe) loop["keyframe"] = *frame.keyframe;
    if (frame.loop->keyframe && by_number.contains(*frame.loop->keyframe)) {
      loop["to_keyframe"] = *frame.loop->keyframe;
      loop["to_distance_m"] = distance.at(by_number[*frame.loop->keyframe]->t_ns);
    }
    loops.push_back(std::move(loop));
  }
  return loops;
}

/// Consecutive frames that were not tracked, as stretches.
Json bridged_json(const ReportRun& run, const DistanceAxis& distance) {
  Json stretches = Json::array();
  std::size_t last = 0;
  for (const FrameLine& frame : run.frames) {
    if (frame.status != "bridged") continue;
    if (stretches.empty() || frame.index != last + 1 || stretches.back()["reason"] != frame.reason) {
      stretches.push_back(
          {{"frame", frame.index}, {"frames", 0}, {"distance_m", distance.at(frame.t_ns)}, {"reason", frame.reason}});
    }
    stretches.back()["frames"] = stretches.back()["frames"].get<int>() + 1;
    last = frame.index;
  }
  return stretches;
}

/// Over all frames: {"total_ms": {"mean", "median", "p95", "max"}, ...}.
Json timing_statistics(const Columns& timings) {
  Json json = Json::object();
  for (const Column& timing : timings) {
    const ColumnStatistics s = statistics_of(timing);
    if (s.count == 0) continue;  // a replay has no frames to time
    json[timing.name] = {{"mean", s.mean}, {"median", s.median}, {"p95", s.p95}, {"max", s.max}};
  }
  return json;
}

Json parsed(const std::string& text) {
  Json json = Json::parse(text, nullptr, false);
  return json.is_discarded() ? Json(nullptr) : json;
}

std::optional<RunDataset> dataset_of(const ReportRun& run, std::vector<std::string>& notes) {
  try {
    return RunDataset(run);
  } catch (const Error& error) {
    notes.push_back(run.name + ": no keyframe images (" + error.what() + ")");
    return std::nullopt;
  }
}

/// What needs more than the run's text files: the map, the dataset, the DEM.
void add_factors_and_views(const ReportRun& run, const std::vector<KeyframePose>& keyframes,
                           const DistanceAxis& distance, const PageContext& context, Json& json) {
  const auto map = open_map(run, *context.notes);
  const auto dataset = dataset_of(run, *context.notes);
  std::optional<RectifiedRig> rig;
  if (map) rig = map->header().rig;
  if (dataset) rig = dataset->rig();
  json["residuals"] = residuals_json(run, keyframes, distance, map ? &*map : nullptr);
  json["residuals"].update(factor_residuals_json(run, keyframes, distance, context.share.rows));
  if (context.dem != nullptr && rig) {
    json["terrain_residuals"] =
        packed(thinned(terrain_residuals(keyframes, distance, *context.dem, rig->p_body_ground), context.share.rows));
  }
  if (dataset && context.share.images > 0) {
    json["views"] = views_json(keyframes, map ? &*map : nullptr, *dataset, context.share, *context.images);
  }
  if (map) json["map_bytes"] = std::filesystem::file_size(run.folder / "map.db");
}

}  // namespace

Json run_json(const ReportRun& run, const PageContext& context) {
  const DistanceAxis distance(run);
  const std::vector<KeyframePose> keyframes = keyframe_poses(run);
  Json json = {{"name", run.name},
               {"summary", parsed(run.summary)},
               {"config", run.config},
               {"evaluation", run.evaluation ? parsed(evaluation_json(*run.evaluation)) : Json(nullptr)},
               {"distance_along", run.evaluation ? "truth" : "own track"},
               {"track", packed(thinned(track(run.trajectory), context.share.track_points))},
               {"odometry", packed(thinned(track(run.odometry), context.share.track_points))},
               {"frames", packed(envelope(frame_columns(run, distance), context.share.rows))},
               {"keyframes", packed(keyframe_columns(run, keyframes, distance))},
               {"loops", loops_json(run, keyframes, distance)},
               {"bridged", bridged_json(run, distance)},
               {"timings", timing_statistics(run.timings)}};
  if (run.evaluation) json["errors"] = packed(envelope(error_columns(*run.evaluation), context.share.rows));
  add_factors_and_views(run, keyframes, distance, context, json);
  return json;
}

}  // namespace demslam
