#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <string>

#include "demslam/base/text.h"
#include "demslam/dataset/test_folder.h"
#include "demslam/dem/dem.h"
#include "demslam/evaluation/trajectory_io.h"
#include "demslam/store/test_map.h"

namespace demslam::test {

/// A run folder and its dataset as demslam writes them: a drive along +x over level ground, 0.5 m and 1 s per frame,
/// every fourth frame a keyframe; the estimate stands 0.1 m north of the truth and 0.2 m above it.
class SmallRun {
 public:
  static constexpr std::size_t kEvery = 4;
  static constexpr double kStep_m = 0.5;
  explicit SmallRun(std::size_t frames) : frames_(frames) {
    write_dataset();
    write_texts();
  }
  std::filesystem::path run() const { return folder_.path() / "run"; }
  std::filesystem::path dataset() const { return folder_.path() / "data"; }
  std::filesystem::path dem() const { return dataset() / "dem.tif"; }
  std::size_t keyframes() const { return (frames_ + kEvery - 1) / kEvery; }

  /// As `demslam run` leaves it: a measured step of 2.01 m between keyframes that ended up 2 m apart.
  void write_map() const {
    MapStore store = MapStore::create(run() / "map.db", small_header());
    std::vector<StoredEstimate> estimates;
    for (std::size_t k = 0; k < keyframes(); ++k) {
      KeyframeEntry added{.keyframe = {k, k * kEvery, stamp(k * kEvery), pose(k * kEvery, 0.1, 0.2), {}, ""},
                          .features = random_features(k)};
      added.frames.push_back({k * kEvery, stamp(k * kEvery), "tracked", k, {}, record(k * kEvery)});
      const Pose step(Eigen::Quaterniond::Identity(), {2.01, 0.0, 0.0});
      if (k > 0) added.factors.push_back({.measurement = {k - 1, k, step, 1e-4 * Matrix6d::Identity()}, .inliers = 80});
      store.append(added);
      estimates.push_back({k, added.keyframe.T_map_body, 0.01 * Matrix6d::Identity()});
    }
    store.set_final_estimates(estimates);
  }

 private:
  static TimestampNs stamp(std::size_t frame) { return static_cast<TimestampNs>(frame) * 1'000'000'000; }
  static Pose pose(std::size_t frame, double north_m, double up_m) {
    return {Eigen::Quaterniond::Identity(), {kStep_m * static_cast<double>(frame), north_m, up_m}};
  }
  Trajectory trajectory(double north_m, double up_m) const {
    Trajectory result;
    for (std::size_t f = 0; f < frames_; ++f) result.push_back({stamp(f), pose(f, north_m, up_m)});
    return result;
  }

  static std::string record(std::size_t frame) {
    const std::string keyframe = frame % kEvery == 0 ? fmt::format(",\"keyframe\":{}", frame / kEvery) : "";
    return fmt::format(
        R"({{"frame":{},"t_ns":{},"status":"tracked","keypoints":500,"matches":{},"inliers":90,"rms_px":0.5{}}})",
        frame, stamp(frame), 100 + frame % 7, keyframe);
  }

  void write_dataset() const {
    folder_.text(
        "data/calibration.toml",
        "baseline_m = 0.3\n[left]\nwidth = 640\nheight = 480\nfx = 400.0\nfy = 400.0\ncx = 319.5\ncy = 239.5\n");
    folder_.text("data/gt.txt", euroc_text(trajectory(0.0, 0.0)));
    for (const std::size_t f : {std::size_t{0}, frames_ - 1}) {
      for (const char* camera : {"image0", "image1"})
        folder_.image(fmt::format("data/{}/color/{}.png", camera, stamp(f)), 128, 640, 480);
    }
    const double length_m = kStep_m * static_cast<double>(frames_);
    DemRaster raster{
        .rows = 12, .cols = static_cast<int>(length_m / 5.0) + 12, .cell_m = 5.0, .west_m = -30.0, .north_m = 30.0};
    raster.heights.assign(static_cast<std::size_t>(raster.rows) * raster.cols, 0.0F);
    raster.frame = {};
    write_dem(dem(), raster);
  }

  void write_texts() const {
    std::string frames, timings = "frame,extract_ms,total_ms\n", covariances = "# header\nt_ns";
    for (std::size_t f = 0; f < frames_; ++f) {
      frames += record(f) + "\n";
      timings += fmt::format("{},{:.3f},{:.3f}\n", f, 2.0, f == frames_ / 2 ? 900.0 : 40.0);
    }
    folder_.text("run/frames.jsonl", frames);
    folder_.text("run/timings.csv", timings);
    folder_.text("run/trajectory.tum", tum_text(trajectory(0.1, 0.2)));
    folder_.text("run/odometry.tum", tum_text(trajectory(0.1, 0.2)));
    folder_.text("run/residuals.csv", "kind,keyframe,rows,chi_square\ndem_height,1,1,4\nterrain_patch,2,25,100\n");
    folder_.text("run/config.toml", "[odometry]\nmethod = \"window\" # </script>\n");
    folder_.text(
        "run/summary.json",
        fmt::format(R"({{"inputs":{{"dataset":"{}","format":"demslam","dem":{{"path":"{}"}}}},"frames_asked":{}}})",
                    dataset().string(), dem().string(), frames_));
  }

  TestFolder folder_;
  std::size_t frames_;
};

}  // namespace demslam::test
