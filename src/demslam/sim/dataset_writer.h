#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "demslam/dem/dem.h"
#include "demslam/geometry/trajectory.h"
#include "demslam/image/image.h"
#include "demslam/sim/scene.h"
#include "demslam/sim/sensors.h"

namespace demslam {

/// One finished frame of a simulation.
struct SimulatedFrame {
  TimestampNs t_ns = 0;
  Image left, right;                             ///< of more than 8 bits: the upper ones
  std::vector<std::uint16_t> left_16, right_16;  ///< those of more than 8 bits, aligned to the upper end; else empty
  std::vector<float> depth_m;            ///< left camera, rows from the top; empty: not wanted, as for those below
  std::vector<Eigen::Vector3f> normals;  ///< left camera, map frame
  Image labels;                          ///< left camera
  std::string lidar;                     ///< lines of points
};

/// Writes the LuSNAR layout. Every file appears under its name only when complete, so a killed run leaves whole frames.
class DatasetWriter {
 public:
  /// Makes the folders. Throws Error when `out` cannot be written or holds another scene.
  DatasetWriter(std::filesystem::path out, const SceneOptions& scene);

  bool has(TimestampNs t_ns) const;
  void write(const SimulatedFrame& frame) const;
  void write_text(const std::string& name, const std::string& text) const;
  void write_raster(const std::string& name, const DemRaster& raster) const;
  /// The last call: removes what only a killed run needs.
  void close() const;

 private:
  void make_frame_folders() const;
  std::filesystem::path file(const char* folder, TimestampNs t_ns, const char* extension) const;
  std::filesystem::path unfinished(const std::filesystem::path& file) const;
  void publish(const std::filesystem::path& file) const;  ///< from its unfinished place to its name
  void write_bytes(const std::filesystem::path& file, const std::string& bytes) const;
  void write_picture(const std::filesystem::path& file, const Image& image,
                     const std::vector<std::uint16_t>& deep = {}) const;

  std::filesystem::path out_;
  OutputOptions output_;
};

/// Lines of ns, x y z, quaternion w x y z.
std::string stamped_pose_text(const Trajectory& trajectory);

/// gt.txt: LuSNAR's 17 columns: ns, T_map_body as x y z and quaternion w x y z, velocity (map), gyro and accelerometer
/// bias (0).
std::string ground_truth_text(const Trajectory& trajectory, const ImuBias& bias = {});

/// A one-channel PFM: little-endian floats, bottom row first.
std::string pfm_bytes(const std::vector<float>& values, int width, int height);
/// A three-channel one.
std::string pfm_bytes(const std::vector<Eigen::Vector3f>& values, int width, int height);

}  // namespace demslam
