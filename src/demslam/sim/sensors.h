#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "demslam/dataset/sensors.h"
#include "demslam/geometry/trajectory.h"
#include "demslam/image/image.h"
#include "demslam/sim/renderer.h"

namespace demslam {

/// T_map_body at any time of the drive, seconds since its first frame.
using PoseAtTime = std::function<Pose(double time_s)>;

/// imu.txt as LuSNAR has it: ns, angular rate x y z (rad/s), specific force x y z (m/s^2) of the body at its origin,
/// 100 Hz. White noise 1.7e-4 rad/s/sqrt(Hz) and 2e-3 m/s^2/sqrt(Hz), and constant biases of 1e-4 rad/s and 2e-3 m/s^2
/// (one sigma).
std::string imu_text(const PoseAtTime& motion, TimestampNs first_ns, double duration_s, std::uint64_t seed);

struct ImuBias {
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero(), accelerometer = Eigen::Vector3d::Zero();
};
ImuBias imu_bias(std::uint64_t seed);

/// wheels.txt, 10 Hz: ns, distance rolled by the left and by the right wheels since the start (m). On a slope the
/// wheels turn more than the rover advances, by the rover's slip per degree uphill; 1 % noise per step.
std::string wheels_text(const PoseAtTime& motion, TimestampNs first_ns, double duration_s, const RoverOptions& rover,
                        std::uint64_t seed);

/// sun.csv (dataset/sun_sensor.h) at every pose of the drive: the direction of a fixed sun as a sensor of `sigma_deg`
/// per axis measures it in the body.
std::string sun_text(const Trajectory& trajectory, const Eigen::Vector3d& sun_map, double sigma_deg,
                     std::uint64_t seed);

/// A LuSNAR-like scanner: 128 beams from +15 to -25 degrees, 512 azimuths over 360 degrees, at most 30 m.
struct Lidar {
  static constexpr int kBeams = 128, kAzimuths = 512;
  static constexpr double kRangeM = 30.0, kNoiseM = 0.01;

  Lidar();
  /// Returns in the sensor's frame (forward, left, up).
  std::vector<LidarPoint> scan(const Renderer& renderer, const Terrain& terrain, const Pose& T_map_lidar,
                               std::uint64_t seed) const;

  Pose T_body_lidar;  ///< on the mast, between the cameras and above them
  std::vector<Eigen::Vector3d> directions;
};

/// LiDAR/<stamp>.txt as LuSNAR has it (dataset/sensors.h).
std::string lidar_text(const std::vector<LidarPoint>& scan);

/// Semantic classes of an image: 0 sky, 1 regolith, 2 crater (inside the rim), 3 rock.
Image label_image(const Rendering& rendering, const Camera& camera, const Pose& T_map_camera, const Terrain& terrain);

}  // namespace demslam
