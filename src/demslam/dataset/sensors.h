#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <vector>

#include "demslam/base/time.h"

namespace demslam {

/// A LiDAR return in the sensor's frame, metres.
struct LidarPoint {
  Eigen::Vector3d p_sensor = Eigen::Vector3d::Zero();
  int category = 0;  ///< LuSNAR: -1 regolith, 0 crater, 174 rock
};

/// LuSNAR LiDAR/<stem>.txt: lines `x,y,z,category`. A scan without returns is an empty list.
std::vector<LidarPoint> read_lidar_scan(const std::filesystem::path& file);

struct ImuSample {
  TimestampNs t_ns = 0;
  Eigen::Vector3d angular_rate_rad_s = Eigen::Vector3d::Zero(), acceleration_m_s2 = Eigen::Vector3d::Zero();
};

/// LuSNAR imu.txt and EuRoC imu0/data.csv: lines `t [ns], w xyz, a xyz`, stamps increasing. Throws Error with the line.
/// With a period, the means over periods of that length: a drive of hours has millions of samples.
std::vector<ImuSample> read_imu(const std::filesystem::path& file, TimestampNs period_ns = 0);

/// Distance rolled by the left and by the right wheels since the start.
struct WheelSample {
  TimestampNs t_ns = 0;
  double left_m = 0.0, right_m = 0.0;
};

/// wheels.txt: lines `t [ns], left, right [m]`, stamps increasing. Throws Error with the line.
std::vector<WheelSample> read_wheels(const std::filesystem::path& file);

/// A depth image along the camera's forward axis, metres, top row first.
struct DepthImage {
  int width = 0, height = 0;
  std::vector<float> depth_m;

  float at(int u, int v) const { return depth_m[static_cast<std::size_t>(v) * width + u]; }
};

/// PFM with one channel ("Pf"); the file stores the bottom row first, its scale's sign names the byte order.
/// Throws Error when the file is truncated or of another kind.
DepthImage read_pfm(const std::filesystem::path& file);

}  // namespace demslam
