#include "demslam/sim/rendered_sequence.h"

#include <tbb/task_arena.h>

#include <mutex>
#include <utility>

#include "demslam/dataset/calibration.h"
#include "demslam/sim/mission.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

/// The scene with nothing but its images to be made.
SceneOptions images_only(SceneOptions scene) {
  scene.output = {.depth = false};
  return scene;
}

class RenderedSequence : public StereoSequence {
 public:
  RenderedSequence(fs::path path, fs::path calibration)
      : path_(std::move(path)),
        calibration_(std::move(calibration)),
        rig_(read_calibration(calibration_).rig),
        start_(read_start_pose(path_ / "start.toml")),
        mission_(images_only(read_scene(path_ / "scene.toml"))) {}

  std::string format() const override { return "demslam"; }
  const StereoRig& rig() const override { return rig_; }
  std::size_t size() const override { return mission_.trajectory().size(); }
  TimestampNs stamp_ns(std::size_t index) const override { return mission_.trajectory().at(index).t_ns; }
  std::optional<StartPose> start() const override { return start_; }
  std::optional<fs::path> dem_file() const override {
    const fs::path dem = path_ / "dem.tif";
    return fs::exists(dem) ? std::optional(dem) : std::nullopt;
  }
  std::vector<fs::path> definition_files() const override {
    return {calibration_, path_ / "start.toml", path_ / "scene.toml"};
  }

  StereoFrame frame(std::size_t index) const override {
    const std::lock_guard lock(mutex_);
    // Isolated: a thread that waits for its rows must not take up other work that asks for a frame, under the lock.
    SimulatedFrame made = tbb::this_task_arena::isolate([&] { return mission_.frame(index); });
    return {made.t_ns, std::move(made.left), std::move(made.right)};
  }

 private:
  fs::path path_, calibration_;
  StereoRig rig_;
  StartPose start_;
  mutable std::mutex mutex_;
  mutable Mission mission_;  ///< its surroundings move with the frame asked for
};

}  // namespace

bool is_rendered_dataset(const fs::path& path) {
  return fs::is_regular_file(path / "scene.toml") && fs::is_regular_file(path / "calibration.toml") &&
         !fs::exists(path / "image0");
}

std::unique_ptr<StereoSequence> open_rendered_dataset(const fs::path& path, const fs::path& calibration) {
  return std::make_unique<RenderedSequence>(path, calibration.empty() ? path / "calibration.toml" : calibration);
}

}  // namespace demslam
