#include "demslam/odometry/motion_search.h"

#include <algorithm>
#include <array>
#include <vector>

#include "demslam/geometry/angle.h"
#include "demslam/odometry/guided_match.h"

namespace demslam {
namespace {

/// Around where a point is predicted: part of the image's width, and Lowe's ratio. A good prediction needs little else;
/// at last everywhere, for a learned matcher may know nothing of a turn that nearest neighbours still tell.
struct SearchNear {
  double radius, ratio;
};
constexpr std::array<SearchNear, 3> kSearches = {{{0.04, 0.97}, {0.12, 0.9}, {2.0, 0.9}}};

/// A consensus of few among many matches is believed if half as many points again, and a tenth of all that have a
/// depth, are then found by their patches: about a wrong motion patches fit no better than by chance.
constexpr double kWitnesses = 1.5, kWitnessShare = 0.1;

/// Over a crater's rim a rover rolls and pitches as no prediction foresees: by so much about each axis, the least turns
/// first. The narrow search reaches half of it.
std::vector<Pose> unforeseen_turns() {
  constexpr double kTurnDeg = 5.0;
  constexpr int kTurns = 27;
  std::vector<Eigen::Vector3d> turns;
  turns.reserve(kTurns);
  for (int k = 0; k < kTurns; ++k) turns.emplace_back(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
  std::ranges::stable_sort(turns, {}, [](const Eigen::Vector3d& turn) { return turn.squaredNorm(); });
  std::vector<Pose> poses;
  poses.reserve(kTurns);
  for (const Eigen::Vector3d& turn : turns) {
    Vector6d twist = Vector6d::Zero();
    twist.head<3>() = kTurnDeg * kRadPerDeg * turn;
    poses.push_back(Pose::exp(twist));
  }
  return poses;
}

/// Two views, and how to search them.
class Search {
 public:
  Search(const RectifiedRig& rig, const StereoView& a, const StereoView& b, const MotionOptions& options,
         bool by_patches)
      : rig_(rig), a_(a), b_(b), options_(options), by_patches_(by_patches) {}

  std::optional<Motion> near(const Pose& guess, const SearchNear& search) const {
    const auto matches = match_near(rig_, *a_.features, *b_.features, guess, search.radius * rig_.width, search.ratio);
    Motion motion = estimate_motion(rig_, matches, options_, &guess);
    if (refusal(motion, options_).empty()) return motion;
    if (!by_patches_ || !motion.ok) return std::nullopt;
    Motion witnessed = refine_directly(rig_, a_, b_, motion, options_);
    const double enough = std::max(kWitnesses * motion.inliers, kWitnessShare * points_with_depth(*a_.features));
    if (witnessed.inliers < enough || !refusal(witnessed, options_).empty()) return std::nullopt;
    return witnessed;
  }

 private:
  const RectifiedRig& rig_;
  const StereoView &a_, &b_;
  const MotionOptions& options_;
  bool by_patches_;
};

}  // namespace

std::string refusal(const Motion& motion, const MotionOptions& options) {
  if (!motion.ok) return motion.reason;
  if (motion.inliers >= options.min_inlier_ratio * motion.matches) return {};
  return "too few of the matches agree (" + std::to_string(motion.inliers) + " of " + std::to_string(motion.matches) +
         ")";
}

int points_with_depth(const StereoFeatures& features) {
  return static_cast<int>(std::ranges::count_if(features.disparity_px, [](float d) { return d > 0.0F; }));
}

std::optional<Motion> search_motion(const RectifiedRig& rig, const StereoView& a, const StereoView& b,
                                    const Pose& guess_T_a_b, const MotionOptions& options, bool by_patches) {
  const Search search(rig, a, b, options, by_patches);
  for (const SearchNear& how : kSearches) {
    if (auto found = search.near(guess_T_a_b, how)) return found;
  }
  const Pose unturned(Eigen::Quaterniond::Identity(), guess_T_a_b.translation());
  for (const Pose& turn : unforeseen_turns()) {
    for (const Pose& from : {guess_T_a_b, unturned}) {
      if (auto found = search.near(from * turn, kSearches.front())) return found;
    }
  }
  return std::nullopt;
}

}  // namespace demslam
