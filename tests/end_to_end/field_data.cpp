#include "field_data.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>

#include "demslam/base/text.h"
#include "demslam/base/time.h"
#include "demslam/dataset/ros_messages.h"
#include "demslam/dataset/rosbag_writer.h"
#include "demslam/dataset/sequence.h"
#include "demslam/dem/dem.h"
#include "demslam/evaluation/trajectory_io.h"
#include "demslam/image/rectify.h"

namespace demslam::testing_support {
namespace {

namespace fs = std::filesystem;

std::uint32_t crc32(const std::string& bytes) {
  std::uint32_t crc = 0xffffffffU;
  for (const char byte : bytes) {
    crc ^= static_cast<unsigned char>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ (0xedb88320U & (0U - (crc & 1U)));
  }
  return ~crc;
}

std::uint32_t adler32(const std::string& bytes) {
  std::uint32_t a = 1, b = 0;
  for (const char byte : bytes) {
    a = (a + static_cast<unsigned char>(byte)) % 65521U;
    b = (b + a) % 65521U;
  }
  return b << 16U | a;
}

std::string big_endian(std::uint32_t word) {
  return {static_cast<char>(word >> 24U), static_cast<char>(word >> 16U), static_cast<char>(word >> 8U),
          static_cast<char>(word)};
}

std::string png_chunk(const std::string& type, const std::string& data) {
  return big_endian(static_cast<std::uint32_t>(data.size())) + type + data + big_endian(crc32(type + data));
}

/// A zlib stream of stored blocks.
std::string stored(const std::string& data) {
  std::string stream = "\x78\x01";
  for (std::size_t at = 0; at < data.size(); at += 65535) {
    const std::size_t size = std::min<std::size_t>(65535, data.size() - at);
    const auto low = static_cast<char>(size), high = static_cast<char>(size >> 8U);
    stream += at + size == data.size() ? '\x01' : '\x00';
    stream += {low, high, static_cast<char>(~low), static_cast<char>(~high)};
    stream += data.substr(at, size);
  }
  return stream + big_endian(adler32(data));
}

void write_file(const fs::path& file, const std::string& bytes) {
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << bytes;
}

/// Half a turn about x: forward, left, up becomes forward, right, down.
Pose half_turn() { return Pose(Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0), Eigen::Vector3d::Zero()); }

std::string lusnar_pose(TimestampNs t_ns, const Pose& pose) {
  const Eigen::Vector3d& p = pose.translation();
  const Eigen::Quaterniond& q = pose.rotation();
  char line[256];
  std::snprintf(line, sizeof line, "%lld,%.9f,%.9f,%.9f,%.12f,%.12f,%.12f,%.12f", static_cast<long long>(t_ns), p.x(),
                p.y(), p.z(), q.w(), q.x(), q.y(), q.z());
  return line;
}

void write_colour(const fs::path& from, const fs::path& to, bool with_index) {
  std::string index = "#timestamp [ns],filename\n";
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(from)) names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  for (const std::string& name : names) {
    write_file(to / name, rgba_png(read_image(from / name)));
    index += fs::path(name).stem().string() + "," + name + "\n";
  }
  if (with_index) write_file(to.parent_path() / "color_timestamp.txt", index);
}

constexpr TimestampNs kEpoch_ns = 1'625'657'674'000'000'000;  // 7 July 2021

/// The simulation's first stamp becomes the epoch.
class BagClock {
 public:
  explicit BagClock(TimestampNs first_ns) : shift_ns_(kEpoch_ns - first_ns) {}
  TimestampNs at(TimestampNs t_ns) const { return t_ns + shift_ns_; }

 private:
  TimestampNs shift_ns_;
};

class Camera {
 public:
  Camera(BagWriter& bag, const std::string& side, const RectifiedRig& rig) : bag_(bag), side_(side), rig_(rig) {
    const RosType &image = ros_image_type(), &info = ros_camera_info_type();
    image_ = bag.add_topic("/stereo/" + side + "/image_rect", image.name, image.md5, image.definition);
    info_ = bag.add_topic("/stereo/" + side + "/camera_info", info.name, info.md5, info.definition);
  }
  void write(const Image& image, TimestampNs t_ns, TimestampNs received_ns) {
    const double baseline_m = side_ == "right" ? rig_.baseline_m : 0.0;
    bag_.write(image_, received_ns, encode_ros_image(image, t_ns, side_));
    bag_.write(info_, received_ns, encode_ros_camera_info(rig_, baseline_m, t_ns, side_));
  }

 private:
  BagWriter& bag_;
  std::string side_;
  const RectifiedRig& rig_;
  std::uint32_t image_ = 0, info_ = 0;
};

void write_bag(const StereoSequence& sequence, const fs::path& file, Compression compression) {
  const Rectifier rectifier(sequence.rig());
  BagWriter bag(file, compression);
  Camera left(bag, "left", rectifier.rig()), right(bag, "right", rectifier.rig());
  const BagClock clock(sequence.stamp_ns(0));
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    const StereoFrame frame = sequence.frame(i);
    const TimestampNs t_ns = clock.at(frame.t_ns);
    if (i != 11) left.write(rectifier.left(frame.left), t_ns, t_ns + 21'000'000);
    if (i != 7) right.write(rectifier.right(frame.right), t_ns, t_ns + 23'000'000);
  }
  bag.finish();
}

/// "2021/07/07 11:34:50.700" for a time on that day.
std::string calendar(TimestampNs t_ns) {
  const std::int64_t ms = (t_ns / 1'000'000) % 86'400'000;
  char text[40];
  std::snprintf(text, sizeof text, "2021/07/07 %02d:%02d:%02d.%03d", static_cast<int>(ms / 3'600'000),
                static_cast<int>(ms / 60'000 % 60), static_cast<int>(ms / 1000 % 60), static_cast<int>(ms % 1000));
  return text;
}

std::string fixes(const Trajectory& drive, const LocalFrame& frame, const EtnaOptions& options) {
  const Georeference georeference(frame);
  const BagClock clock(drive.front().t_ns);
  std::string text =
      "% program   : RTKPOST ver.2.4.3\n% pos mode  : Kinematic\n%\n% "
      "(lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float)\n"
      "%  GPST                  latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m)\n";
  for (std::size_t i = 0; i + 1 < drive.size(); ++i) {
    for (int fifth = 0; fifth < 5; ++fifth) {
      const double share = 0.2 * fifth;
      const Eigen::Vector3d p = (1.0 - share) * drive[i].pose.translation() + share * drive[i + 1].pose.translation();
      const Eigen::Vector3d at = georeference.lon_lat_height(p);
      const TimestampNs t_ns =
          clock.at(drive[i].t_ns + std::llround(share * static_cast<double>(drive[i + 1].t_ns - drive[i].t_ns))) +
          std::llround(options.clock_offset_s * 1e9);
      char line[160];
      std::snprintf(line, sizeof line, "%s   %.9f   %.9f   %.4f   %d  12   0.0100   0.0100   0.0200\n",
                    calendar(t_ns).c_str(), at.y(), at.x(), at.z() + options.geoid_undulation_m, i == 3 ? 2 : 1);
      text += line;
    }
  }
  return text;
}

}  // namespace

std::string rgba_png(const Image& grey) {
  std::string lines;
  for (int v = 0; v < grey.height; ++v) {
    lines += '\x00';  // no filter
    for (int u = 0; u < grey.width; ++u) {
      const auto value = static_cast<char>(grey.at(u, v));
      lines += {value, value, value, '\xff'};
    }
  }
  const std::string head = big_endian(static_cast<std::uint32_t>(grey.width)) +
                           big_endian(static_cast<std::uint32_t>(grey.height)) + std::string("\x08\x06\x00\x00\x00", 5);
  return "\x89PNG\r\n\x1a\n" + png_chunk("IHDR", head) + png_chunk("IDAT", stored(lines)) + png_chunk("IEND", "");
}

void write_lusnar(const fs::path& simulated, const fs::path& folder) {
  for (const char* camera : {"image0", "image1"}) {
    write_colour(simulated / camera / "color", folder / camera / "color", std::string(camera) == "image0");
  }
  fs::copy(simulated / "image0/depth", folder / "image0/depth", fs::copy_options::recursive);
  fs::copy(simulated / "LiDAR", folder / "LiDAR", fs::copy_options::recursive);
  fs::copy(simulated / "imu.txt", folder / "imu.txt");
  std::string scans, truth = "#timestamp [ns],p_x [m],p_y [m],p_z [m],q_w [],q_x [],q_y [],q_z [],...\n";
  for (const StampedPose& stamped : read_trajectory(simulated / "LiDAR/timestamp.txt").poses) {
    scans += lusnar_pose(stamped.t_ns + 60, half_turn() * stamped.pose) + "\n";
  }
  for (const StampedPose& stamped : read_trajectory(simulated / "gt.txt").poses) {
    truth += lusnar_pose(stamped.t_ns + 40, half_turn() * stamped.pose * half_turn()) + ",0,0,0,0,0,0,0,0,0\n";
  }
  write_file(folder / "LiDAR/timestamp.txt", scans);
  write_file(folder / "gt.txt", truth);
}

void write_etna(const fs::path& simulated, const fs::path& folder, const EtnaOptions& options) {
  fs::create_directories(folder);
  write_bag(*open_dataset(simulated), folder / "crater.bag", options.compression);
  DemRaster dsm = read_dem(simulated / "dem.tif", Eigen::Vector3d::Zero());
  dsm.frame = {crs_wkt_of("EPSG:32633"), {501200.0, 4177000.0, 2400.0}};
  write_file(folder / "global_lle.pos", fixes(read_trajectory(simulated / "gt.txt").poses, dsm.frame, options));
  write_dem(folder / "dsm.tif", dsm);
}

}  // namespace demslam::testing_support
