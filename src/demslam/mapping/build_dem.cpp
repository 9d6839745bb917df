#include "demslam/mapping/build_dem.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <vector>

#include "demslam/base/error.h"
#include "demslam/dataset/point_cloud.h"
#include "demslam/dataset/sensors.h"
#include "demslam/dataset/sequence.h"
#include "demslam/dem/dem_reader.h"
#include "demslam/evaluation/truth.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

constexpr TimestampNs kPoseTolerance_ns = 5'000'000;
constexpr std::size_t kScansForWorldZ = 10;
constexpr int kRock = 174;  // LuSNAR's category

struct ScanFile {
  TimestampNs t_ns = 0;
  fs::path file;
};

/// Files named by their stamp, in time order.
std::vector<ScanFile> scan_files(const fs::path& folder, const std::string& extension) {
  if (!fs::is_directory(folder)) throw Error(folder.string() + ": the folder with the scans is missing");
  std::vector<ScanFile> scans;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string stem = entry.path().stem().string();
    TimestampNs t_ns = 0;
    const auto [end, error] = std::from_chars(stem.data(), stem.data() + stem.size(), t_ns);
    const bool is_stamp = error == std::errc() && end == stem.data() + stem.size();
    if (entry.path().extension() == extension && is_stamp) scans.push_back({t_ns, entry.path()});
  }
  if (scans.empty()) throw Error(folder.string() + ": holds no " + extension + " file named by its stamp");
  std::sort(scans.begin(), scans.end(), [](const ScanFile& a, const ScanFile& b) { return a.t_ns < b.t_ns; });
  return scans;
}

const Pose* pose_at(const Trajectory& poses, TimestampNs t_ns) {
  const auto after = std::lower_bound(poses.begin(), poses.end(), t_ns - kPoseTolerance_ns,
                                      [](const StampedPose& pose, TimestampNs t) { return pose.t_ns < t; });
  const StampedPose* best = nullptr;
  for (auto it = after; it != poses.end() && it->t_ns <= t_ns + kPoseTolerance_ns; ++it) {
    if (best == nullptr || std::abs(it->t_ns - t_ns) < std::abs(best->t_ns - t_ns)) best = &*it;
  }
  return best == nullptr ? nullptr : &best->pose;
}

using ReadScan = std::function<std::vector<Eigen::Vector3d>(const fs::path&)>;

/// Scans, how to read one (points in the sensor's frame), and the sensor's poses in the map.
struct Survey {
  std::vector<ScanFile> scans;
  ReadScan read;
  Trajectory T_map_sensor;
  bool world_z_down = false;
};

std::vector<Eigen::Vector3d> lidar_points(const fs::path& file, const BuildDemInputs& inputs) {
  std::vector<Eigen::Vector3d> points;
  for (const LidarPoint& point : read_lidar_scan(file)) {
    const bool rock = inputs.without_rocks && point.category == kRock;
    if (!rock && point.p_sensor.norm() <= inputs.max_range_m) points.push_back(point.p_sensor);
  }
  return points;
}

/// A sensor on a mast sees the ground below itself: where most points lie above it, the world's z points down.
bool points_lie_above(const Survey& survey) {
  std::ptrdiff_t above = 0;
  const std::size_t step = std::max<std::size_t>(1, survey.scans.size() / kScansForWorldZ);
  for (std::size_t i = 0; i < survey.scans.size(); i += step) {
    const Pose* const T = pose_at(survey.T_map_sensor, survey.scans[i].t_ns);
    if (T == nullptr) continue;
    for (const Eigen::Vector3d& point : survey.read(survey.scans[i].file)) {
      above += (*T * point).z() > T->translation().z() ? 1 : -1;
    }
  }
  return above > 0;
}

void turn_world(Trajectory& T_world_sensor) {
  const Pose T_map_world(Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0), Eigen::Vector3d::Zero());
  for (StampedPose& stamped : T_world_sensor) stamped.pose = T_map_world * stamped.pose;
}

Survey lidar_survey(const BuildDemInputs& inputs) {
  Survey survey{scan_files(inputs.source / "LiDAR", ".txt"),
                [&inputs](const fs::path& file) { return lidar_points(file, inputs); }};
  if (inputs.p_body_sensor) {
    survey.T_map_sensor = read_truth(inputs.poses).poses;
    const Pose T_body_sensor(Eigen::Quaterniond::Identity(), *inputs.p_body_sensor);
    for (StampedPose& stamped : survey.T_map_sensor) stamped.pose = stamped.pose * T_body_sensor;
    return survey;
  }
  survey.T_map_sensor = read_trajectory(inputs.poses).poses;
  survey.world_z_down = points_lie_above(survey);
  if (survey.world_z_down) turn_world(survey.T_map_sensor);
  return survey;
}

std::vector<Eigen::Vector3d> depth_points(const fs::path& file, const Camera& camera, const BuildDemInputs& inputs) {
  const DepthImage depth = read_pfm(file);
  if (depth.width != camera.width || depth.height != camera.height) {
    throw Error(file.string() + " is " + std::to_string(depth.width) + "x" + std::to_string(depth.height) +
                " but the calibration is for " + std::to_string(camera.width) + "x" + std::to_string(camera.height));
  }
  std::vector<Eigen::Vector3d> points;
  for (int v = 0; v < depth.height; v += inputs.pixel_step) {
    for (int u = 0; u < depth.width; u += inputs.pixel_step) {
      const double z = depth.at(u, v);
      if (!(z > 0.0 && z <= inputs.max_range_m)) continue;  // the sky is at 65504 m
      points.emplace_back((u - camera.cx) * z / camera.fx, (v - camera.cy) * z / camera.fy, z);
    }
  }
  return points;
}

fs::path depth_folder(const fs::path& dataset) {
  for (const char* name : {"image0/depth", "image0/Depth", "image1/Depth", "image1/depth"}) {
    if (fs::is_directory(dataset / name)) return dataset / name;
  }
  return dataset / "image0/depth";
}

Survey depth_survey(const BuildDemInputs& inputs) {
  const auto sequence = open_dataset(inputs.source, "", inputs.calibration);
  const StereoRig rig = sequence->rig();
  if (rig.left.distortion != Distortion::none) {
    throw Error(inputs.source.string() + ": depth images of a distorted camera are not understood");
  }
  Survey survey{scan_files(depth_folder(inputs.source), ".pfm"),
                [rig, &inputs](const fs::path& file) { return depth_points(file, rig.left, inputs); },
                read_truth(inputs.poses).poses};
  for (StampedPose& stamped : survey.T_map_sensor) stamped.pose = stamped.pose * rig.T_body_left;
  return survey;
}

void add_scans(const Survey& survey, DemBuilder& builder, DemBuildReport& report, const Progress& progress) {
  report.world_z_down = survey.world_z_down;
  for (const ScanFile& scan : survey.scans) {
    if (progress.stop_requested()) break;
    if (const Pose* const T_map_sensor = pose_at(survey.T_map_sensor, scan.t_ns)) {
      for (const Eigen::Vector3d& point : survey.read(scan.file)) builder.add(*T_map_sensor * point);
      ++report.scans;
    } else {
      ++report.without_pose;
    }
    progress.report(report.scans + report.without_pose, survey.scans.size());
  }
}

}  // namespace

DemBuildReport build_dem(const BuildDemInputs& inputs, const DemBuildOptions& options, const Progress& progress) {
  DemBuilder builder(options);
  DemBuildReport report;
  if (inputs.kind == CloudKind::points) {
    for (const Eigen::Vector3d& point : read_point_cloud(inputs.source)) builder.add(point);
    report.scans = 1;
  } else {
    if (inputs.poses.empty()) throw Error("dem build: say where the poses come from with --poses FILE");
    if (inputs.pixel_step < 1) throw Error("dem build: the pixel step must be 1 or more");
    add_scans(inputs.kind == CloudKind::lidar ? lidar_survey(inputs) : depth_survey(inputs), builder, report, progress);
    if (report.scans == 0) throw Error(inputs.poses.string() + ": none of its poses is within 5 ms of a scan");
  }
  report.dem = builder.finish(inputs.like ? DemReader(*inputs.like).grid().frame : LocalFrame{});
  return report;
}

void write_built_dem(const fs::path& file, const BuiltDem& dem) {
  const auto beside = [&](const char* suffix) {
    fs::path path = file;
    return path.replace_filename(file.stem().string() + suffix + ".tif");
  };
  write_dem(beside("_sigma"), dem.sigma);
  write_dem(beside("_count"), dem.counts);
  write_dem(file, dem.heights);
}

}  // namespace demslam
