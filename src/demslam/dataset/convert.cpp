#include "demslam/dataset/convert.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>

#include "demslam/base/error.h"
#include "demslam/base/text.h"
#include "demslam/dataset/calibration.h"
#include "demslam/dataset/ros_messages.h"
#include "demslam/dataset/rosbag_writer.h"
#include "demslam/image/rectify.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

struct Task {
  const StereoSequence& sequence;
  const fs::path& output;
  const Progress& progress;
};

/// Calls `write(index, frame)` for every pair until a stop is asked for. Returns how many were written.
template <class Write>
std::size_t for_each_frame(const Task& task, const Write& write) {
  std::size_t done = 0;
  for (std::size_t i = 0; i < task.sequence.size() && !task.progress.stop_requested(); ++i) {
    write(i, task.sequence.frame(i));
    task.progress.report(++done, task.sequence.size());
  }
  return done;
}

std::string shortest(double value) {
  std::array<char, 32> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
  return {buffer.data(), end};
}

template <class Values>
std::string joined(const Values& values, const char* separator) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : separator) + shortest(value);
  return text;
}

/// The DEM, and its uncertainty where that lies beside it.
void copy_dem(const fs::path& dem, const fs::path& folder) {
  fs::copy_file(dem, folder / "dem.tif");
  fs::path sigma = dem;
  sigma.replace_filename(dem.stem().string() + "_sigma.tif");
  if (fs::exists(sigma)) fs::copy_file(sigma, folder / "dem_sigma.tif");
}

ConvertedDataset write_demslam(const Task& task) {
  const fs::path left = task.output / "image0/color", right = task.output / "image1/color";
  fs::create_directories(left);
  fs::create_directories(right);
  write_text(task.output / "calibration.toml", calibration_toml(task.sequence.rig()));
  if (const auto start = task.sequence.start()) write_text(task.output / "start.toml", start_pose_toml(*start));
  if (const auto dem = task.sequence.dem_file()) copy_dem(*dem, task.output);
  const std::size_t pairs = for_each_frame(task, [&](std::size_t, const StereoFrame& frame) {
    const std::string name = std::to_string(frame.t_ns) + ".png";
    write_image(left / name, frame.left);
    write_image(right / name, frame.right);
  });
  return {pairs, Pose()};
}

std::string sensor_yaml(const Camera& camera, const Pose& T_body_camera) {
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> T = T_body_camera.matrix();
  const bool fisheye = camera.distortion == Distortion::equidistant;
  const std::vector<double> k(camera.coefficients.begin(), camera.coefficients.end() - (fisheye ? 1 : 0));
  return "%YAML:1.0\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [" +
         joined(std::vector<double>(T.data(), T.data() + 16), ", ") + "]\nresolution: [" +
         std::to_string(camera.width) + ", " + std::to_string(camera.height) +
         "]\ncamera_model: pinhole\nintrinsics: [" +
         joined(std::array{camera.fx, camera.fy, camera.cx, camera.cy}, ", ") +
         "]\ndistortion_model: " + (fisheye ? "equidistant" : "radial-tangential") + "\ndistortion_coefficients: [" +
         joined(k, ", ") + "]\n";
}

ConvertedDataset write_euroc(const Task& task) {
  const StereoRig& rig = task.sequence.rig();
  const fs::path left = task.output / "mav0/cam0", right = task.output / "mav0/cam1";
  for (const fs::path& camera : {left, right}) fs::create_directories(camera / "data");
  write_text(left / "sensor.yaml", sensor_yaml(rig.left, rig.T_body_left));
  write_text(right / "sensor.yaml", sensor_yaml(rig.right, rig.T_body_left * rig.T_left_right));
  std::string index = "#timestamp [ns],filename\n";
  const std::size_t pairs = for_each_frame(task, [&](std::size_t, const StereoFrame& frame) {
    const std::string stamp = std::to_string(frame.t_ns), name = stamp + ".png";
    write_image(left / "data" / name, frame.left);
    write_image(right / "data" / name, frame.right);
    index += stamp + "," + name + "\n";
  });
  for (const fs::path& camera : {left, right}) write_text(camera / "data.csv", index);
  return {pairs, Pose()};
}

std::string kitti_calib(const RectifiedRig& rig) {
  const auto line = [&](const char* name, double baseline_m) {
    const double f = rig.focal_px;
    return name + joined(std::array{f, 0.0, rig.cx, -f * baseline_m, 0.0, f, rig.cy, 0.0, 0.0, 0.0, 1.0, 0.0}, " ") +
           "\n";
  };
  return line("P0: ", 0.0) + line("P1: ", rig.baseline_m);
}

ConvertedDataset write_kitti(const Task& task) {
  const Rectifier rectifier(task.sequence.rig());
  const fs::path left = task.output / "image_0", right = task.output / "image_1";
  fs::create_directories(left);
  fs::create_directories(right);
  write_text(task.output / "calib.txt", kitti_calib(rectifier.rig()));
  std::string times;
  const std::size_t pairs = for_each_frame(task, [&](std::size_t i, const StereoFrame& frame) {
    std::array<char, 32> name{};
    std::snprintf(name.data(), name.size(), "%06zu.png", i);
    write_image(left / name.data(), rectifier.left(frame.left));
    write_image(right / name.data(), rectifier.right(frame.right));
    times += seconds_text(frame.t_ns) + "\n";
  });
  write_text(task.output / "times.txt", times);
  return {pairs, rectifier.rig().T_body_left};
}

/// The topics of one camera in a bag.
struct CameraTopics {
  CameraTopics(BagWriter& bag, std::string side) : frame_id(std::move(side)) {
    const RosType &image_type = ros_image_type(), &info_type = ros_camera_info_type();
    const std::string prefix = "/stereo/" + frame_id + "/";
    image = bag.add_topic(prefix + "image_rect", image_type.name, image_type.md5, image_type.definition);
    info = bag.add_topic(prefix + "camera_info", info_type.name, info_type.md5, info_type.definition);
  }
  std::string frame_id;
  std::uint32_t image = 0, info = 0;
};

ConvertedDataset write_bag(const Task& task) {
  const Rectifier rectifier(task.sequence.rig());
  const RectifiedRig& rig = rectifier.rig();
  BagWriter bag(task.output, Compression::lz4);
  const CameraTopics left(bag, "left"), right(bag, "right");
  const auto write = [&](const CameraTopics& topics, const Image& image, double baseline_m, TimestampNs t_ns) {
    bag.write(topics.image, t_ns, encode_ros_image(image, t_ns, topics.frame_id));
    bag.write(topics.info, t_ns, encode_ros_camera_info(rig, baseline_m, t_ns, topics.frame_id));
  };
  const std::size_t pairs = for_each_frame(task, [&](std::size_t, const StereoFrame& frame) {
    write(left, rectifier.left(frame.left), 0.0, frame.t_ns);
    write(right, rectifier.right(frame.right), rig.baseline_m, frame.t_ns);
  });
  bag.finish();
  return {pairs, rig.T_body_left * level_T_body_left().inverse()};
}

struct Writer {
  const char* format;
  ConvertedDataset (*write)(const Task& task);
};
constexpr std::array kWriters = {Writer{"demslam", write_demslam}, Writer{"euroc", write_euroc},
                                 Writer{"kitti", write_kitti}, Writer{"rosbag", write_bag}};

void check_output(const fs::path& output) {
  if (!fs::exists(output) || (fs::is_directory(output) && fs::is_empty(output))) return;
  throw Error(output.string() + ": exists already; give a name that is free");
}

}  // namespace

std::vector<std::string> writable_formats() {
  std::vector<std::string> names;
  for (const Writer& writer : kWriters) names.emplace_back(writer.format);
  return names;
}

ConvertedDataset convert_dataset(const StereoSequence& sequence, const std::string& format, const fs::path& output,
                                 const Progress& progress) {
  const auto writer =
      std::find_if(kWriters.begin(), kWriters.end(), [&](const Writer& w) { return w.format == format; });
  if (writer == kWriters.end()) {
    throw Error("datasets cannot be written as '" + format + "'; known are demslam, euroc, kitti and rosbag");
  }
  check_output(output);
  try {
    return writer->write({sequence, output, progress});
  } catch (const fs::filesystem_error& error) {
    throw Error(output.string() + ": cannot be written: " + error.code().message());
  }
}

}  // namespace demslam
