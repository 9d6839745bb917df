// Plain folders: left/ and right/ images in natural order, and a calibration.
#include "demslam/base/error.h"
#include "demslam/dataset/calibration.h"
#include "demslam/dataset/readers.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

constexpr double kDefaultFrameRateHz = 10.0;

bool recognises(const fs::path& path) { return fs::is_directory(path / "left") && fs::is_directory(path / "right"); }

std::unique_ptr<StereoSequence> open(const fs::path& path, const fs::path& given) {
  const fs::path calibration_file = given.empty() ? path / "calibration.toml" : given;
  if (!fs::exists(calibration_file)) {
    throw Error(calibration_file.string() + ": the calibration is missing; put one there or pass --calibration FILE");
  }
  const Calibration calibration = read_calibration(calibration_file);
  ImageDataset dataset{.format = "folders", .path = path, .rig = calibration.rig};
  dataset.pairs = pair_images(path / "left", path / "right");
  dataset.definition_files = {calibration_file};
  const fs::path times = path / "times.txt";
  stamp_pairs(dataset.pairs, times, calibration.frame_rate_hz.value_or(kDefaultFrameRateHz));
  if (fs::exists(times)) dataset.definition_files.push_back(times);
  return make_sequence(std::move(dataset));
}

}  // namespace

const DatasetReader kFoldersReader = {"folders", "left, right and a calibration TOML", recognises, open};

}  // namespace demslam
