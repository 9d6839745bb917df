// EuRoC (ASL) layout: mav0/cam{0,1}/{data,data.csv,sensor.yaml}; pairs by equal stamp; the body is that of T_BS.
// TUM-VI has the same layout with a Kalibr camchain instead of the sensor.yaml; its body is the IMU.
#include "demslam/base/error.h"
#include "demslam/base/text.h"
#include "demslam/dataset/calibration.h"
#include "demslam/dataset/calibration_import.h"
#include "demslam/dataset/readers.h"
#include "demslam/dataset/yaml.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

struct StampedFile {
  TimestampNs t_ns = 0;
  fs::path file;
};

fs::path root_of(const fs::path& path) { return fs::is_directory(path / "mav0") ? path / "mav0" : path; }

std::vector<StampedFile> read_index(const fs::path& camera) {
  const TextTable table = read_table(camera / "data.csv");
  std::vector<StampedFile> images;
  for (const TextRow& row : table.rows) {
    if (row.fields.size() != 2) table.fail(row, "a line must be 'stamp [ns], filename'");
    const TimestampNs t_ns = table.integer(row, 0);
    if (!images.empty() && t_ns <= images.back().t_ns) table.fail(row, "the stamps must increase");
    images.push_back({t_ns, camera / "data" / row.fields[1]});
  }
  return images;
}

void pair_by_stamp(ImageDataset& dataset, const std::vector<StampedFile>& left, const std::vector<StampedFile>& right) {
  auto partner = right.begin();
  for (const StampedFile& image : left) {
    while (partner != right.end() && partner->t_ns < image.t_ns) ++partner;
    if (partner == right.end() || partner->t_ns != image.t_ns) continue;
    dataset.pairs.push_back({image.t_ns, image.file, partner->file});
  }
  dataset.unpaired = left.size() + right.size() - 2 * dataset.pairs.size();
}

struct MountedCamera {
  Camera camera;
  Pose T_body_camera;
};

MountedCamera read_sensor(const fs::path& file) {
  const Yaml yaml = Yaml::from_file(file);
  return {read_listed_camera(yaml, "distortion_coefficients"), yaml["T_BS"].pose()};
}

StereoRig rig_of_sensors(const fs::path& left_file, const fs::path& right_file) {
  const MountedCamera left = read_sensor(left_file), right = read_sensor(right_file);
  StereoRig rig{left.camera, right.camera, left.T_body_camera.inverse() * right.T_body_camera, left.T_body_camera};
  check_rig(rig, left_file.string());
  return rig;
}

/// The Kalibr file that TUM-VI has in place of the sensor.yaml.
std::optional<fs::path> camchain_of(const fs::path& root) {
  for (const char* name : {"dso/camchain.yaml", "camchain.yaml"}) {
    if (fs::is_regular_file(root.parent_path() / name)) return root.parent_path() / name;
  }
  return std::nullopt;
}

void read_rig(const fs::path& root, const fs::path& given, ImageDataset& dataset) {
  const fs::path left = root / "cam0" / "sensor.yaml", right = root / "cam1" / "sensor.yaml";
  const auto camchain = camchain_of(root);
  if (given.empty() && (fs::exists(left) || !camchain)) {
    dataset.definition_files = {left, right};
    dataset.rig = rig_of_sensors(left, right);
  } else {
    dataset.definition_files = {given.empty() ? *camchain : given};
    dataset.rig = read_calibration(dataset.definition_files.front()).rig;
  }
}

bool recognises(const fs::path& path) {
  const fs::path root = root_of(path);
  return fs::exists(root / "cam0" / "data.csv") && fs::is_directory(root / "cam1");
}

std::unique_ptr<StereoSequence> open(const fs::path& path, const fs::path& calibration) {
  const fs::path left = root_of(path) / "cam0", right = root_of(path) / "cam1";
  ImageDataset dataset{.format = "euroc", .path = path};
  pair_by_stamp(dataset, read_index(left), read_index(right));
  read_rig(root_of(path), calibration, dataset);
  for (const fs::path& camera : {left, right}) dataset.definition_files.push_back(camera / "data.csv");
  return make_sequence(std::move(dataset));
}

}  // namespace

const DatasetReader kEurocReader = {"euroc", "mav0/cam0 and mav0/cam1 with data.csv", recognises, open};

}  // namespace demslam
