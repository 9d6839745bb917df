// The simulator's own layout: LuSNAR's images, with calibration, start and DEM beside them.

#include "demslam/dataset/calibration.h"
#include "demslam/dataset/readers.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

bool recognises(const fs::path& path) {
  return fs::is_regular_file(path / "calibration.toml") && fs::is_directory(path / "image0" / "color");
}

std::unique_ptr<StereoSequence> open(const fs::path& path, const fs::path& calibration) {
  const fs::path calibration_file = calibration.empty() ? path / "calibration.toml" : calibration;
  ImageDataset dataset{.format = "demslam", .path = path, .rig = read_calibration(calibration_file).rig};
  dataset.definition_files = {calibration_file};
  dataset.pairs = pair_images(path / "image0" / "color", path / "image1" / "color");
  stamp_pairs_by_name(dataset.pairs);
  if (const fs::path dem = path / "dem.tif"; fs::exists(dem)) dataset.dem_file = dem;
  if (const fs::path start = path / "start.toml"; fs::exists(start)) {
    dataset.start = read_start_pose(start);
    dataset.definition_files.push_back(start);
  }
  return make_sequence(std::move(dataset));
}

}  // namespace

const DatasetReader kDemslamReader = {"demslam", "calibration.toml, image0/color, image1/color", recognises, open};

}  // namespace demslam
