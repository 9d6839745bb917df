#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "demslam/base/progress.h"
#include "demslam/geometry/camera.h"
#include "demslam/image/image.h"
#include "demslam/sim/scene.h"

namespace demslam {

/// Two rectified stereo views of one place, and what is known of them.
struct ViewPair {
  std::string group;  ///< "drive 0.5 m", "sun 90 deg", "kitti_seq1": pairs that share a row of the table
  RectifiedRig rig;
  Image left_a, right_a, left_b, right_b;
  std::vector<float> depth_a_m;  ///< of left_a; empty: not known
  std::optional<Pose> T_a_b;     ///< left camera b in left camera a
};

/// Takes one pair after the other; false: no more.
using PairSink = std::function<bool(const ViewPair&)>;

/// Simulated places that nothing was trained on: each relief with `seeds` worlds, a short straight drive, and the
/// beginning of the drive again under a sun whose azimuth is turned.
struct SimulatedPairs {
  std::vector<Relief> reliefs = {Relief::highland, Relief::mid, Relief::mare};
  int seeds = 8;
  std::uint64_t first_seed = 7001;  ///< training/places.py draws from 1 and from 9000 on
  int size_px = 512;
  std::vector<double> spacings_m = {0.5, 1.0, 2.0, 3.0};  ///< multiples of kDriveStep_m
  std::vector<double> sun_turns_deg = {30.0, 60.0, 90.0, 180.0};
};
inline constexpr double kDriveStep_m = 0.5;  ///< between frames, and between the two visits of a turned sun

void simulated_pairs(const SimulatedPairs& options, const PairSink& sink, const Progress& progress);

/// Successive frames, `pairs` of them spread over each of the sequences kitti_seq1, euroc_v101_short and rover_sandbox
/// that `data` holds. rover_sandbox needs its `calibration` file (configs/rover_sandbox.toml) and has no truth.
void real_pairs(const std::filesystem::path& data, const std::filesystem::path& calibration, int pairs,
                const PairSink& sink);

}  // namespace demslam
