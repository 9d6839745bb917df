#include "demslam/sim/dataset_writer.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <sstream>
#include <system_error>

#include "demslam/base/error.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

constexpr float kSkyDepth = 65504.0F;  // LuSNAR's mark for no surface
constexpr const char* kUnfinished = ".unfinished";

void make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw Error(folder.string() + ": the folder cannot be made (" + error.message() + ")");
}

std::string read_text(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

std::string pose_columns(const StampedPose& stamped) {
  const Eigen::Vector3d& p = stamped.pose.translation();
  const Eigen::Quaterniond& q = stamped.pose.rotation();
  char columns[256];
  std::snprintf(columns, sizeof columns, "%lld,%.9f,%.9f,%.9f,%.12f,%.12f,%.12f,%.12f",
                static_cast<long long>(stamped.t_ns), p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z());
  return columns;
}

/// Velocity at a frame by central differences, map frame.
Eigen::Vector3d velocity(const Trajectory& trajectory, std::size_t i) {
  const StampedPose& before = trajectory[i > 0 ? i - 1 : i];
  const StampedPose& after = trajectory[std::min(i + 1, trajectory.size() - 1)];
  const double dt = to_seconds(after.t_ns - before.t_ns);
  if (dt <= 0.0) return Eigen::Vector3d::Zero();
  return (after.pose.translation() - before.pose.translation()) / dt;
}

std::string pfm_header(const char* kind, int width, int height) {
  return std::string(kind) + "\n" + std::to_string(width) + " " + std::to_string(height) + "\n-1.0\n";
}

std::string raw_bytes(const std::vector<float>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float)};
}

}  // namespace

DatasetWriter::DatasetWriter(fs::path out, const SceneOptions& scene) : out_(std::move(out)), output_(scene.output) {
  const fs::path scene_file = out_ / "scene.toml";
  const std::string text = scene_toml(scene);
  if (fs::exists(scene_file) && read_text(scene_file) != text) {
    throw Error(out_.string() + ": holds another scene (see its scene.toml); choose an empty folder");
  }
  make_folder(out_ / "truth");
  make_folder(out_ / kUnfinished);
  if (output_.images) make_frame_folders();
  if (!fs::exists(scene_file)) write_text("scene.toml", text);
}

void DatasetWriter::make_frame_folders() const {
  make_folder(out_ / "image0/color");
  make_folder(out_ / "image1/color");
  if (output_.depth) make_folder(out_ / "image0/depth");
  if (output_.normals) make_folder(out_ / "image0/normal");
  if (output_.labels) make_folder(out_ / "image0/label");
  if (output_.lidar) make_folder(out_ / "LiDAR");
}

fs::path DatasetWriter::file(const char* folder, TimestampNs t_ns, const char* extension) const {
  return out_ / folder / (std::to_string(t_ns) + extension);
}

fs::path DatasetWriter::unfinished(const fs::path& file) const { return out_ / kUnfinished / file.filename(); }

bool DatasetWriter::has(TimestampNs t_ns) const {
  const auto there = [&](bool wanted, const char* folder, const char* extension) {
    return !wanted || fs::exists(file(folder, t_ns, extension));
  };
  return there(true, "image0/color", ".png") && there(true, "image1/color", ".png") &&
         there(output_.depth, "image0/depth", ".pfm") && there(output_.labels, "image0/label", ".png") &&
         there(output_.normals, "image0/normal", ".pfm") && there(output_.lidar, "LiDAR", ".txt");
}

void DatasetWriter::publish(const fs::path& file) const {
  std::error_code error;
  fs::rename(unfinished(file), file, error);
  if (error) throw Error(file.string() + ": cannot be written (" + error.message() + ")");
}

void DatasetWriter::write_bytes(const fs::path& file, const std::string& bytes) const {
  std::ofstream stream(unfinished(file), std::ios::binary);
  stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  stream.close();
  if (!stream) throw Error(file.string() + ": cannot be written; is the disk full or the folder read-only?");
  publish(file);
}

void DatasetWriter::write_picture(const fs::path& file, const Image& image,
                                  const std::vector<std::uint16_t>& deep) const {
  if (deep.empty()) {
    write_image(unfinished(file), image);
  } else {
    write_image(unfinished(file), image.width, image.height, deep);
  }
  publish(file);
}

void DatasetWriter::write(const SimulatedFrame& frame) const {
  if (!frame.depth_m.empty()) {
    write_bytes(file("image0/depth", frame.t_ns, ".pfm"),
                pfm_bytes(frame.depth_m, frame.left.width, frame.left.height));
  }
  if (output_.normals) {
    write_bytes(file("image0/normal", frame.t_ns, ".pfm"),
                pfm_bytes(frame.normals, frame.left.width, frame.left.height));
  }
  if (output_.labels) write_picture(file("image0/label", frame.t_ns, ".png"), frame.labels);
  if (output_.lidar) write_bytes(file("LiDAR", frame.t_ns, ".txt"), frame.lidar);
  write_picture(file("image1/color", frame.t_ns, ".png"), frame.right, frame.right_16);
  write_picture(file("image0/color", frame.t_ns, ".png"), frame.left, frame.left_16);
}

void DatasetWriter::write_text(const std::string& name, const std::string& text) const {
  write_bytes(out_ / name, text);
}

void DatasetWriter::write_raster(const std::string& name, const DemRaster& raster) const {
  write_dem(unfinished(out_ / name), raster);
  publish(out_ / name);
}

void DatasetWriter::close() const {
  std::error_code ignored;  // an empty folder that stays harms nobody
  fs::remove_all(out_ / kUnfinished, ignored);
}

std::string ground_truth_text(const Trajectory& trajectory, const ImuBias& bias) {
  std::string text =
      "#timestamp [ns], p_x [m], p_y [m], p_z [m], q_w [], q_x [], q_y [], q_z [], v_x [m s^-1], v_y [m s^-1], v_z [m "
      "s^-1], "
      "b_w_x [rad s^-1], b_w_y [rad s^-1], b_w_z [rad s^-1], b_a_x [m s^-2], b_a_y [m s^-2], b_a_z [m s^-2]\n";
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    text += pose_columns(trajectory[i]);
    for (const Eigen::Vector3d& triple : {velocity(trajectory, i), bias.gyro, bias.accelerometer}) {
      char columns[96];
      std::snprintf(columns, sizeof columns, ",%.9f,%.9f,%.9f", triple.x(), triple.y(), triple.z());
      text += columns;
    }
    text += "\n";
  }
  return text;
}

std::string stamped_pose_text(const Trajectory& trajectory) {
  std::string text;
  for (const StampedPose& stamped : trajectory) text += pose_columns(stamped) + "\n";
  return text;
}

std::string pfm_bytes(const std::vector<float>& values, int width, int height) {
  std::vector<float> rows;
  rows.reserve(values.size());
  for (int v = height - 1; v >= 0; --v) {
    const float* row = values.data() + static_cast<std::size_t>(v) * width;
    std::transform(row, row + width, std::back_inserter(rows),
                   [](float z) { return std::isfinite(z) ? z : kSkyDepth; });
  }
  return pfm_header("Pf", width, height) + raw_bytes(rows);
}

std::string pfm_bytes(const std::vector<Eigen::Vector3f>& values, int width, int height) {
  std::vector<float> rows;
  rows.reserve(3 * values.size());
  for (int v = height - 1; v >= 0; --v) {
    for (int u = 0; u < width; ++u) {
      const Eigen::Vector3f& value = values[static_cast<std::size_t>(v) * width + u];
      rows.insert(rows.end(), value.data(), value.data() + 3);
    }
  }
  return pfm_header("PF", width, height) + raw_bytes(rows);
}

}  // namespace demslam
