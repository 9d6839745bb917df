// KITTI odometry: calib.txt, two image folders, times.txt. The body is camera 0, the frame of KITTI's own poses.
#include <array>
#include <map>

#include "demslam/base/error.h"
#include "demslam/base/text.h"
#include "demslam/dataset/calibration.h"
#include "demslam/dataset/readers.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

constexpr double kFrameRateHz = 10.0;

/// The image folders of a pair and the cameras of calib.txt they belong to.
struct Layout {
  const char *left, *right;
  int left_camera, right_camera;
};
constexpr std::array kLayouts = {Layout{"image_0", "image_1", 0, 1}, Layout{"image_2", "image_3", 2, 3},
                                 Layout{"image_l", "image_r", 0, 1}};

const Layout* layout_of(const fs::path& path) {
  for (const Layout& layout : kLayouts) {
    if (fs::is_directory(path / layout.left) && fs::is_directory(path / layout.right)) return &layout;
  }
  return nullptr;
}

using Projection = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;

/// P0, P1, ... by camera; lines come with their name ("P0: ...") or bare, then in the order of the cameras.
std::map<int, Projection> read_projections(const fs::path& file) {
  const TextTable table = read_table(file);
  std::map<int, Projection> projections;
  for (const TextRow& row : table.rows) {
    const std::string& name = row.fields.front();
    const bool named = name.back() == ':';
    if (named && (name.size() != 3 || name[0] != 'P')) continue;  // Tr: and other rows
    const std::size_t first = named ? 1 : 0;
    if (row.fields.size() != first + 12) table.fail(row, "a projection matrix must have 12 numbers");
    Projection& P = projections[named ? name[1] - '0' : static_cast<int>(projections.size())];
    for (std::size_t i = 0; i < 12; ++i) P(i / 4, i % 4) = table.number(row, first + i);
  }
  return projections;
}

Camera camera_of(const Projection& P, const Image& image) {
  return {.width = image.width, .height = image.height, .fx = P(0, 0), .fy = P(1, 1), .cx = P(0, 2), .cy = P(1, 2)};
}

/// The camera's centre in camera 0: P = K [I | -centre].
Eigen::Vector3d centre_of(const Projection& P) { return -P.leftCols<3>().inverse() * P.col(3); }

StereoRig read_rig(const fs::path& file, const Layout& layout, const Image& image) {
  const std::map<int, Projection> projections = read_projections(file);
  const auto left = projections.find(layout.left_camera), right = projections.find(layout.right_camera);
  if (left == projections.end() || right == projections.end()) {
    throw Error(file.string() + ": the lines P" + std::to_string(layout.left_camera) + " and P" +
                std::to_string(layout.right_camera) + " are missing");
  }
  StereoRig rig{camera_of(left->second, image), camera_of(right->second, image)};
  const Eigen::Vector3d p_left = centre_of(left->second), p_right = centre_of(right->second);
  rig.T_left_right = Pose(Eigen::Quaterniond::Identity(), p_right - p_left);
  rig.T_body_left = Pose(Eigen::Quaterniond::Identity(), p_left);
  check_rig(rig, file.string());
  return rig;
}

bool recognises(const fs::path& path) { return layout_of(path) != nullptr; }

std::unique_ptr<StereoSequence> open(const fs::path& path, const fs::path& calibration) {
  const Layout* layout = layout_of(path);
  if (layout == nullptr) throw Error(path.string() + ": image_0 and image_1 (or image_2 and image_3) are missing");
  ImageDataset dataset{
      .format = "kitti", .path = path, .pairs = pair_images(path / layout->left, path / layout->right)};
  const fs::path calib = calibration.empty() ? path / "calib.txt" : calibration, times = path / "times.txt";
  if (!dataset.pairs.empty()) {
    dataset.rig = calibration.empty() ? read_rig(calib, *layout, read_image(dataset.pairs.front().left))
                                      : read_calibration(calib).rig;
  }
  stamp_pairs(dataset.pairs, times, kFrameRateHz);
  dataset.definition_files = {calib};
  if (fs::exists(times)) dataset.definition_files.push_back(times);
  return make_sequence(std::move(dataset));
}

}  // namespace

const DatasetReader kKittiReader = {"kitti", "calib.txt, image_0 and image_1", recognises, open};

}  // namespace demslam
