#include "demslam/sim/surveyed_ground.h"

#include "demslam/sim/sensors.h"

namespace demslam {

BuiltDem surveyed_ground(Mission& mission, double spacing_m, const DemBuildOptions& options) {
  const Pose T_body_lidar = Lidar().T_body_lidar;
  DemBuilder builder(options);
  double since_m = spacing_m;  // the first pose is scanned
  const Trajectory& drive = mission.trajectory();
  for (std::size_t i = 0; i < drive.size(); ++i) {
    if (i > 0) since_m += (drive[i].pose.translation() - drive[i - 1].pose.translation()).norm();
    if (since_m < spacing_m) continue;
    since_m = 0.0;
    const Pose T_map_lidar = drive[i].pose * T_body_lidar;
    for (const LidarPoint& point : mission.scan(i)) builder.add(T_map_lidar * point.p_sensor);
  }
  return builder.finish(mission.terrain().base().raster().frame);
}

}  // namespace demslam
