#include <gtest/gtest.h>

#include <filesystem>
#include <utility>

#include "demslam/features/frontend.h"
#include "demslam/image/rectify.h"
#include "demslam/odometry/odometry.h"
#include "demslam/sim/mission.h"

namespace demslam {
namespace {

/// Over the rim of a small crater with 0.8 m from frame to frame: the rover rolls and pitches by up to ten degrees
/// otherwise than before, over ground of little texture.
TEST(StereoOdometry, FollowsTheRoverOverACratersRim) {
  SceneOptions scene = read_scene(std::filesystem::path(DEMSLAM_SOURCE_DIR) / "configs" / "mare_300m.toml");
  scene.seed = 3;
  scene.camera.width_px = scene.camera.height_px = 384;
  scene.rover.space_frames(0.8);
  Mission mission(scene);
  StereoOdometry odometry(Rectifier(mission.rig()).rig(), make_frontend({}), {});
  for (std::size_t frame = 41; frame < 47; ++frame) {
    SimulatedFrame pair = mission.frame(frame);
    const OdometryResult result = odometry.process(pair.t_ns, std::move(pair.left), std::move(pair.right));
    EXPECT_NE(result.status, Tracking::bridged) << "frame " << frame << ": " << result.reason;
  }
}

}  // namespace
}  // namespace demslam
