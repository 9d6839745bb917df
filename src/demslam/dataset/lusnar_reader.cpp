// LuSNAR as downloaded, in the naming that ships (image0/color) and in that of its README (image1/RGB). No calibration
// ships with it: the one below is the paper's. Poses, LiDAR and IMU lie beside the images and are not read here.
#include <array>
#include <numbers>

#include "demslam/base/error.h"
#include "demslam/dataset/calibration.h"
#include "demslam/dataset/readers.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

struct Folders {
  fs::path left, right;
};

std::optional<Folders> folders_of(const fs::path& path) {
  constexpr std::array kPairs = {std::array{"image0", "image1"}, std::array{"image1", "image2"}};
  for (const auto& [left, right] : kPairs) {
    for (const char* colour : {"color", "RGB"}) {
      Folders folders{path / left / colour, path / right / colour};
      if (fs::is_directory(folders.left) && fs::is_directory(folders.right)) return folders;
    }
  }
  return std::nullopt;
}

/// The left camera sits at (1.0, -0.155, -1.5) m of a forward, right, down rover frame, pitched 20 degrees down; our
/// body is forward, left, up, and the rover's origin is on the ground.
StereoRig lusnar_rig() {
  constexpr double kFocalPx = 610.17784, kCentrePx = 512.0, kBaselineM = 0.310;
  constexpr double kPitchDown = 20.0 * std::numbers::pi / 180.0;
  const Camera camera{.width = 1024, .height = 1024, .fx = kFocalPx, .fy = kFocalPx, .cx = kCentrePx, .cy = kCentrePx};
  StereoRig rig{camera, camera, Pose(Eigen::Quaterniond::Identity(), {kBaselineM, 0.0, 0.0})};
  rig.T_body_left = Pose(rotation_from_rpy(0.0, kPitchDown, 0.0) * R_body_camera_level(), {1.0, 0.155, 1.5});
  return rig;
}

bool recognises(const fs::path& path) { return folders_of(path).has_value(); }

std::unique_ptr<StereoSequence> open(const fs::path& path, const fs::path& calibration) {
  const auto folders = folders_of(path);
  if (!folders)
    throw Error(path.string() + ": image0/color and image1/color (or image1/RGB and image2/RGB) are missing");
  ImageDataset dataset{.format = "lusnar", .path = path, .rig = lusnar_rig()};
  if (!calibration.empty()) {
    dataset.rig = read_calibration(calibration).rig;
    dataset.definition_files = {calibration};
  }
  dataset.pairs = pair_images(folders->left, folders->right);
  stamp_pairs_by_name(dataset.pairs);
  return make_sequence(std::move(dataset));
}

}  // namespace

const DatasetReader kLusnarReader = {"lusnar", "image0/color and image1/color, or image1/RGB and image2/RGB",
                                     recognises, open};

}  // namespace demslam
