#include "demslam/evaluation/export.h"

#include <cmath>
#include <limits>

#include "demslam/base/error.h"
#include "demslam/base/text.h"
#include "demslam/dem/dem_reader.h"
#include "demslam/dem/geo_track.h"
#include "demslam/evaluation/runs.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

/// The folder that is written to, and what has been written.
class Folder {
 public:
  explicit Folder(fs::path path) : path_(std::move(path)) {
    std::error_code error;
    fs::create_directories(path_, error);
    if (error) throw Error(path_.string() + ": cannot be made (" + error.message() + ")");
  }
  void text(const std::string& name, const std::string& content) {
    write_text(path_ / name, content);
    files_.push_back(path_ / name);
  }
  void raster(const std::string& name, const DemRaster& content) {
    write_dem(path_ / name, content);
    files_.push_back(path_ / name);
  }
  const std::vector<fs::path>& files() const { return files_; }

 private:
  fs::path path_;
  std::vector<fs::path> files_;
};

std::string times_text(const Trajectory& trajectory) {
  std::string text;
  for (const StampedPose& stamped : trajectory) text += seconds_text(stamped.t_ns) + "\n";
  return text;
}

void write_tracks(Folder& folder, const Trajectory& trajectory, const LocalFrame& frame, const std::string& name) {
  folder.text(name + ".geojson", geojson_track(trajectory, frame, name));
  folder.text(name + ".kml", kml_track(trajectory, frame, name));
}

void write_trajectory(Folder& folder, const Trajectory& trajectory) {
  folder.text("trajectory.tum", tum_text(trajectory));
  folder.text("trajectory_kitti.txt", kitti_text(trajectory));
  folder.text("times.txt", times_text(trajectory));
  folder.text("trajectory_euroc.csv", euroc_text(trajectory));
}

/// What a truth adds: itself, and the error where there is a DEM to draw it on.
void write_truth(Folder& folder, const ExportInputs& inputs, const TrajectoryFile& estimate,
                 const std::optional<DemRaster>& grid) {
  const auto file = truth_file(inputs.run_or_trajectory, inputs.truth);
  if (!file) return;
  const Truth truth = read_truth(*file, inputs.options);
  folder.text("truth.tum", tum_text(truth.file.poses));
  if (!grid) return;
  AssociationOptions association{inputs.max_difference_s,
                                 clock_offset_of(truth.file.poses, estimate.poses, inputs.options)};
  association.by_index = pairs_by_index(truth.file, estimate);
  folder.raster("error.tif", error_raster(*grid, associate(truth.file.poses, estimate.poses, association)));
  if (!grid->frame.crs_wkt.empty()) write_tracks(folder, truth.file.poses, grid->frame, "truth");
}

}  // namespace

DemRaster error_raster(DemRaster grid, const PosePairs& pairs) {
  grid.heights.assign(static_cast<std::size_t>(grid.rows) * grid.cols, std::numeric_limits<float>::quiet_NaN());
  grid.frame.origin.z() = 0.0;
  grid.frame.heights = HeightDatum::unstated;
  std::vector<int> counts(grid.heights.size(), 0);
  for (std::size_t i = 0; i < pairs.estimate.size(); ++i) {
    const Eigen::Vector3d& p = pairs.estimate[i].pose.translation();
    const double col = std::floor((p.x() - grid.west_m) / grid.cell_m);
    const double row = std::floor((grid.north_m - p.y()) / grid.cell_m);
    if (!(col >= 0.0 && row >= 0.0 && col < grid.cols && row < grid.rows)) continue;
    float& mean = grid.at(static_cast<int>(row), static_cast<int>(col));
    int& count = counts[static_cast<std::size_t>(&mean - grid.heights.data())];
    const auto error = static_cast<float>((p - pairs.truth[i].pose.translation()).norm());
    mean = count == 0 ? error : mean + (error - mean) / static_cast<float>(count + 1);
    ++count;
  }
  return grid;
}

std::vector<fs::path> export_run(const ExportInputs& given) {
  ExportInputs inputs = given;
  const bool is_run = fs::is_directory(inputs.run_or_trajectory);
  if (!inputs.options.dem) inputs.options.dem = dem_of_run(inputs.run_or_trajectory);
  const TrajectoryFile estimate =
      read_trajectory(is_run ? inputs.run_or_trajectory / "trajectory.tum" : inputs.run_or_trajectory);
  std::optional<DemRaster> grid;
  if (inputs.options.dem) grid = DemReader(*inputs.options.dem).grid();
  Folder folder(inputs.output);
  write_trajectory(folder, estimate.poses);
  if (grid && !grid->frame.crs_wkt.empty()) write_tracks(folder, estimate.poses, grid->frame, "trajectory");
  write_truth(folder, inputs, estimate, grid);
  return folder.files();
}

}  // namespace demslam
