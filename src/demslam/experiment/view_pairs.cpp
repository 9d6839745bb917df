#include "demslam/experiment/view_pairs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "demslam/dataset/sequence.h"
#include "demslam/evaluation/association.h"
#include "demslam/evaluation/truth.h"
#include "demslam/image/rectify.h"
#include "demslam/sim/mission.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

SceneOptions scene_of(const SimulatedPairs& options, Relief relief, std::uint64_t seed, double sun_turn_deg) {
  SceneOptions scene;
  scene.seed = seed;
  scene.terrain.relief = relief;
  scene.terrain.size_m = 150.0;
  scene.camera.width_px = scene.camera.height_px = options.size_px;
  // Elevations of 8 to 40 degrees and any azimuth, by the seed alone.
  scene.light.sun_elevation_deg = 8.0 + static_cast<double>(seed * 7 % 33);
  scene.light.sun_azimuth_deg = std::fmod(static_cast<double>(seed * 77 % 360) + sun_turn_deg, 360.0);
  scene.rover.speed_m_per_s = kDriveStep_m;
  scene.rover.length_m = *std::ranges::max_element(options.spacings_m) + kDriveStep_m;
  return scene;
}

RectifiedRig ideal(const StereoRig& rig) { return Rectifier(rig).rig(); }

/// The place as first seen, waiting for its partner.
ViewPair first_view(Mission& mission, std::size_t index) {
  SimulatedFrame frame = mission.frame(index);
  return {.rig = ideal(mission.rig()),
          .left_a = std::move(frame.left),
          .right_a = std::move(frame.right),
          .depth_a_m = std::move(frame.depth_m)};
}

void add_second_view(ViewPair& pair, const std::string& group, const Pose& T_map_body_a, Mission& mission,
                     std::size_t index) {
  SimulatedFrame frame = mission.frame(index);
  const Pose T_map_left_a = T_map_body_a * mission.rig().T_body_left;
  pair.group = group;
  pair.left_b = std::move(frame.left);
  pair.right_b = std::move(frame.right);
  pair.T_a_b = T_map_left_a.inverse() * mission.trajectory()[index].pose * mission.rig().T_body_left;
}

/// False: the sink wants no more.
bool pairs_of_place(const SimulatedPairs& options, Relief relief, std::uint64_t seed, const PairSink& sink) {
  Mission first(scene_of(options, relief, seed, 0.0));
  ViewPair pair = first_view(first, 0);
  const Pose T_map_body_a = first.trajectory().front().pose;
  for (const double spacing_m : options.spacings_m) {
    const auto index = static_cast<std::size_t>(std::lround(spacing_m / kDriveStep_m));
    add_second_view(pair, fmt::format("drive {:g} m", spacing_m), T_map_body_a, first, index);
    if (!sink(pair)) return false;
  }
  for (const double turn_deg : options.sun_turns_deg) {
    Mission again(scene_of(options, relief, seed, turn_deg));
    add_second_view(pair, fmt::format("sun {:g} deg", turn_deg), T_map_body_a, again, 1);
    if (!sink(pair)) return false;
  }
  return true;
}

/// A real sequence and how its truth is to be read.
struct RealSequence {
  const char* name;
  const char* truth;  ///< file in its folder; null: none
  bool of_camera;     ///< the truth is the left camera's, not the body's
};
constexpr RealSequence kSequences[] = {{"rover_sandbox", nullptr, false},
                                       {"kitti_seq1", "poses.txt", true},
                                       {"euroc_v101_short", "ground_truth_tum.txt", false}};

Trajectory truth_of(const StereoSequence& sequence, const fs::path& file) {
  const TrajectoryFile truth = read_truth(file);
  Trajectory stamps;
  for (std::size_t i = 0; i < sequence.size(); ++i) stamps.push_back({sequence.stamp_ns(i), Pose()});
  return associate(truth.poses, stamps, {.by_index = truth.indexed}).truth;
}

void pairs_of_sequence(const RealSequence& real, const fs::path& folder, const fs::path& calibration, int count,
                       const PairSink& sink) {
  const auto sequence = open_dataset(folder, "", real.truth == nullptr ? calibration : fs::path());
  const Rectifier rectifier(sequence->rig());
  Trajectory truth;
  if (real.truth != nullptr) truth = truth_of(*sequence, folder / real.truth);
  const bool has_truth = truth.size() == sequence->size();
  const Pose T_truth_left = real.of_camera ? Pose() : rectifier.rig().T_body_left;
  const std::size_t step = std::max<std::size_t>((sequence->size() - 1) / static_cast<std::size_t>(count), 1);
  for (std::size_t i = 0; i + 1 < sequence->size(); i += step) {
    const StereoFrame a = sequence->frame(i), b = sequence->frame(i + 1);
    ViewPair pair{.group = real.name,
                  .rig = rectifier.rig(),
                  .left_a = rectifier.left(a.left),
                  .right_a = rectifier.right(a.right),
                  .left_b = rectifier.left(b.left),
                  .right_b = rectifier.right(b.right)};
    if (has_truth) pair.T_a_b = (truth[i].pose * T_truth_left).inverse() * truth[i + 1].pose * T_truth_left;
    if (!sink(pair)) return;
  }
}

}  // namespace

void simulated_pairs(const SimulatedPairs& options, const PairSink& sink, const Progress& progress) {
  const std::size_t places = options.reliefs.size() * static_cast<std::size_t>(options.seeds);
  for (std::size_t i = 0; i < places; ++i) {
    progress.report(i, places);
    if (progress.stop_requested()) return;
    const Relief relief = options.reliefs[i % options.reliefs.size()];
    if (!pairs_of_place(options, relief, options.first_seed + i / options.reliefs.size(), sink)) return;
  }
  progress.report(places, places);
}

void real_pairs(const fs::path& data, const fs::path& calibration, int pairs, const PairSink& sink) {
  for (const RealSequence& real : kSequences) {
    if (fs::is_directory(data / real.name)) {
      pairs_of_sequence(real, data / real.name, calibration, pairs, sink);
    }
  }
}

}  // namespace demslam
