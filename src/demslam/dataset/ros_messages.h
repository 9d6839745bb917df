#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "demslam/base/time.h"
#include "demslam/geometry/camera.h"
#include "demslam/image/image.h"

namespace demslam {

/// What ROS tools must know to read a message: its type, digest and definition.
struct RosType {
  std::string name, md5, definition;
};
const RosType& ros_image_type();
const RosType& ros_camera_info_type();

/// The stamp of any message that begins with a std_msgs/Header. Needs its first 12 bytes.
TimestampNs ros_header_stamp(std::span<const std::uint8_t> message, const std::string& source);
constexpr std::size_t kRosStampBytes = 12;

/// sensor_msgs/Image as 8-bit grey: mono8 and 8UC1 as they are; mono16 and 16UC1 by their upper byte; rgb8, bgr8, rgba8
/// and bgra8 by Rec. 601 luma. Throws Error naming another encoding.
Image decode_ros_image(std::span<const std::uint8_t> message, const std::string& source);
std::vector<std::uint8_t> encode_ros_image(const Image& image, TimestampNs t_ns, const std::string& frame_id);

/// sensor_msgs/CameraInfo, the fields a rectified camera needs.
struct RosCameraInfo {
  int width = 0, height = 0;
  std::array<double, 9> K{};
  std::array<double, 12> P{};  ///< of the rectified image; P[3] = -fx * baseline of the right camera

  Camera rectified() const;
};
RosCameraInfo decode_ros_camera_info(std::span<const std::uint8_t> message, const std::string& source);
/// Of an ideal rectified pair; `baseline_m` is zero for the left camera.
std::vector<std::uint8_t> encode_ros_camera_info(const RectifiedRig& rig, double baseline_m, TimestampNs t_ns,
                                                 const std::string& frame_id);

}  // namespace demslam
