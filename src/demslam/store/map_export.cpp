#include "demslam/store/map_export.h"

#include <algorithm>
#include <format>
#include <fstream>

#include "demslam/base/error.h"
#include "demslam/base/text.h"
#include "demslam/store/blob.h"
#include "demslam/store/map_info.h"
#include "demslam/store/map_store.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

/// A file that must be complete: an Error otherwise.
class Output {
 public:
  explicit Output(fs::path file) : file_(std::move(file)), stream_(file_, std::ios::binary | std::ios::trunc) {}
  void write(std::string_view text) { stream_ << text; }
  fs::path finish() {
    stream_.close();
    if (!stream_) throw Error(file_.string() + ": cannot be written (disk full, or the folder is not writable)");
    return file_;
  }

 private:
  fs::path file_;
  std::ofstream stream_;
};

std::string pose_text(const Pose& pose, char separator) {
  const auto& p = pose.translation();
  const auto& q = pose.rotation();
  std::string text = std::format("{:.9f} {:.9f} {:.9f} {:.12f} {:.12f} {:.12f} {:.12f}", p.x(), p.y(), p.z(), q.x(),
                                 q.y(), q.z(), q.w());
  std::ranges::replace(text, ' ', separator);
  return text;
}

fs::path export_keyframes(const MapStore& store, const fs::path& folder) {
  Output output(folder / "keyframes.tum");
  output.write("# timestamp_s tx ty tz qx qy qz qw   (T_map_body)\n");
  for (const StoredEstimate& estimate : store.estimates()) {
    output.write(seconds_text(store.keyframe(estimate.keyframe).t_ns) + " " + pose_text(estimate.T_map_body, ' ') +
                 "\n");
  }
  return output.finish();
}

std::string factor_text(const StoredFactor& factor) {
  const RelativePose& m = factor.measurement;
  std::string line = std::format("{},{},{},{},{:.6g},{},{}", factor.kind == FactorKind::loop ? "loop" : "odometry", m.i,
                                 m.j, factor.status, factor.chi_square, factor.inliers, pose_text(m.T_i_j, ','));
  for (int i = 0; i < 36; ++i) line += std::format(",{:.6e}", m.covariance(i / 6, i % 6));
  return line + "\n";
}

fs::path export_factors(const MapStore& store, const fs::path& folder) {
  Output output(folder / "factors.csv");
  std::string header = "kind,i,j,status,chi_square,inliers,tx_m,ty_m,tz_m,qx,qy,qz,qw";
  for (int i = 0; i < 36; ++i) header += std::format(",c{}{}", i / 6, i % 6);
  output.write(header + "\n");
  for (const StoredFactor& factor : store.factors()) output.write(factor_text(factor));
  return output.finish();
}

/// Landmarks of a keyframe in the map frame. Single precision: a millimetre at 10 km from the map's origin.
std::vector<Eigen::Vector3f> landmarks(const RectifiedRig& rig, const StereoFeatures& features,
                                       const Pose& T_map_body) {
  const Pose T_map_left = T_map_body * rig.T_body_left;
  std::vector<Eigen::Vector3f> points;
  for (std::size_t i = 0; i < features.left.size(); ++i) {
    if (!features.has_depth(i)) continue;
    const Eigen::Vector2d pixel = features.left.keypoints[i].cast<double>();
    points.emplace_back((T_map_left * rig.unproject(pixel, features.disparity_px[i])).cast<float>());
  }
  return points;
}

fs::path export_landmarks(const MapStore& store, std::size_t count, const fs::path& folder) {
  Output output(folder / "landmarks.ply");
  output.write(
      std::format("ply\nformat binary_little_endian 1.0\ncomment demslam landmarks, map frame, metres\n"
                  "element vertex {}\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
                  count));
  const RectifiedRig rig = store.header().rig;
  for (const StoredEstimate& estimate : store.estimates()) {
    const auto points = landmarks(rig, *store.features(estimate.keyframe), estimate.T_map_body);
    output.write(bytes_of(std::span<const Eigen::Vector3f>(points)));
  }
  return output.finish();
}

}  // namespace

std::vector<fs::path> export_map(const fs::path& map, const fs::path& folder) {
  const MapStore store = MapStore::open_read_only(map);
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw Error(folder.string() + ": cannot be made (" + error.message() + ")");
  return {export_keyframes(store, folder), export_factors(store, folder),
          export_landmarks(store, map_info(map).landmarks, folder)};
}

}  // namespace demslam
