#include "demslam/report/internal/residual_json.h"

#include <cmath>
#include <limits>
#include <map>
#include <ranges>

#include "demslam/base/text.h"
#include "demslam/report/internal/packed.h"
#include "demslam/report/residuals.h"

namespace demslam {
namespace {

using Json = nlohmann::ordered_json;

/// Residuals with the place of their newer keyframe.
class ResidualTable {
 public:
  void add(double distance_m, const RelativeResidual& residual) {
    const double row[] = {distance_m, residual.translation_m, residual.rotation_deg, residual.chi_square};
    for (std::size_t c = 0; c < columns_.size(); ++c) columns_[c].values.push_back(static_cast<float>(row[c]));
  }
  const Columns& columns() const { return columns_; }

 private:
  Columns columns_{{"distance_m", {}}, {"translation_m", {}}, {"rotation_deg", {}}, {"chi_square", {}}};
};

/// By the factors of the map.
Json of_map(const MapStore& map, const DistanceAxis& distance) {
  std::vector<Pose> T_map_body;
  for (const StoredEstimate& estimate : map.estimates()) T_map_body.push_back(estimate.T_map_body);
  const std::vector<StoredKeyframe> keyframes = map.keyframes();
  ResidualTable odometry, loops;
  for (const StoredFactor& factor : map.factors()) {
    const auto& [i, j, T_i_j, covariance] = factor.measurement;
    if (std::max(i, j) >= std::min(T_map_body.size(), keyframes.size()) || factor.status != "accepted") continue;
    ResidualTable& table = factor.kind == FactorKind::loop ? loops : odometry;
    table.add(distance.at(keyframes[j].t_ns), residual_of(factor.measurement, T_map_body[i], T_map_body[j]));
  }
  return {{"odometry", packed(odometry.columns())}, {"loop", packed(loops.columns())}};
}

/// By the two trajectories. Their covariances are not known.
Json of_trajectories(const ReportRun& run, const std::vector<KeyframePose>& keyframes, const DistanceAxis& distance) {
  ResidualTable odometry;
  for (std::size_t k = 1; k < keyframes.size(); ++k) {
    const KeyframePose &before = keyframes[k - 1], &now = keyframes[k];
    const Pose* T_map_before = pose_at(run.odometry, before.t_ns);
    const Pose* T_map_now = pose_at(run.odometry, now.t_ns);
    if (T_map_before == nullptr || T_map_now == nullptr) continue;
    RelativeResidual residual = residual_of({before.number, now.number, T_map_before->inverse() * *T_map_now},
                                            before.T_map_body, now.T_map_body);
    residual.chi_square = std::numeric_limits<double>::quiet_NaN();
    odometry.add(distance.at(now.t_ns), residual);
  }
  return {{"odometry", packed(odometry.columns())}};
}

}  // namespace

Json residuals_json(const ReportRun& run, const std::vector<KeyframePose>& keyframes, const DistanceAxis& distance,
                    const MapStore* map) {
  return map != nullptr ? of_map(*map, distance) : of_trajectories(run, keyframes, distance);
}

Json factor_residuals_json(const ReportRun& run, const std::vector<KeyframePose>& keyframes,
                           const DistanceAxis& distance, std::size_t max_rows) {
  const std::filesystem::path file = run.folder / "residuals.csv";
  if (!std::filesystem::exists(file)) return Json::object();
  std::map<std::int64_t, TimestampNs> t_ns;
  for (const KeyframePose& keyframe : keyframes) t_ns[static_cast<std::int64_t>(keyframe.number)] = keyframe.t_ns;
  std::map<std::string, Columns> kinds;
  const TextTable table = read_table(file);
  for (const TextRow& row : table.rows | std::views::drop(1)) {
    const auto at = t_ns.find(table.integer(row, 1));
    const bool start = row.fields[0] == "prior" && table.integer(row, 1) == 0;
    if (at == t_ns.end() || start) continue;  // a keyframe that was bridged; what the run was told
    Columns& columns = kinds.try_emplace(row.fields[0], Columns{{"distance_m", {}}, {"sigmas", {}}}).first->second;
    columns[0].values.push_back(static_cast<float>(distance.at(at->second)));
    columns[1].values.push_back(static_cast<float>(std::sqrt(table.number(row, 3) / table.number(row, 2))));
  }
  Json json = Json::object();
  for (const auto& [kind, columns] : kinds) json[kind] = packed(envelope(columns, max_rows));
  return json;
}

Columns terrain_residuals(const std::vector<KeyframePose>& keyframes, const DistanceAxis& distance, const Dem& dem,
                          const Eigen::Vector3d& p_body_ground) {
  Columns columns{{"distance_m", {}}, {"height_m", {}}, {"normal_deg", {}}};
  for (const KeyframePose& keyframe : keyframes) {
    const TerrainResidual residual = residual_of(dem, keyframe.T_map_body, p_body_ground);
    const double row[] = {distance.at(keyframe.t_ns), residual.height_m, residual.normal_deg};
    for (std::size_t c = 0; c < columns.size(); ++c) columns[c].values.push_back(static_cast<float>(row[c]));
  }
  return columns;
}

}  // namespace demslam
