#include "demslam/graph/appearance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "demslam/base/random.h"
#include "demslam/graph/test_paths.h"

namespace demslam {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

GlobalDescriptor leaning(int degrees) {
  GlobalDescriptor descriptor{};
  descriptor[0] = static_cast<std::int8_t>(std::lrint(127.0 * std::cos(degrees * M_PI / 180.0)));
  descriptor[1] = static_cast<std::int8_t>(std::lrint(127.0 * std::sin(degrees * M_PI / 180.0)));
  return descriptor;
}

TEST(PlaceIndex, GivesTheMostSimilarOfTheOldPlaces) {
  PlaceIndex index;
  for (const int degrees : {80, 10, 40, 10, 0}) index.add(leaning(degrees));
  EXPECT_THAT(index.nearest(leaning(0), 4, 3), ElementsAre(1, 3, 2));
  EXPECT_THAT(index.nearest(leaning(0), 5, 1), ElementsAre(4));
  EXPECT_THAT(index.nearest(leaning(90), 1, 3), ElementsAre(0));
  EXPECT_THAT(index.nearest(leaning(90), 0, 3), IsEmpty());
}

/// Points of the ground have descriptors of their own; a view from `place` (in steps) shows those of five steps.
std::shared_ptr<const StereoFeatures> view_from(std::uint64_t place) {
  constexpr Eigen::Index kPerStep = 40, kSteps = 5, kWidth = 64;
  auto view = std::make_shared<StereoFeatures>();
  view->left.descriptors.resize(kPerStep * kSteps, kWidth);
  for (Eigen::Index s = 0; s < kSteps; ++s) {
    Random random(place + static_cast<std::uint64_t>(s));
    for (Eigen::Index r = s * kPerStep; r < (s + 1) * kPerStep; ++r) {
      for (Eigen::Index c = 0; c < kWidth; ++c) view->left.descriptors(r, c) = static_cast<float>(random.normal());
    }
  }
  view->left.descriptors.rowwise().normalize();
  return view;
}

/// A circle of `kLap` steps, driven more than once.
constexpr std::size_t kLap = 80;
FeatureSource circling(int* reads = nullptr) {
  return [reads](std::size_t keyframe) {
    if (reads != nullptr) ++*reads;
    return view_from(keyframe % kLap);
  };
}

TEST(Appearance, KnowsAPlaceAgain) {
  Appearance appearance(circling());
  for (std::size_t k = 0; k <= kLap + 20; ++k) appearance.see(k);
  EXPECT_EQ(appearance.like(kLap + 20, kLap, 3).front(), 20U);
  EXPECT_THAT(appearance.like(kLap + 20, kLap, 3), testing::UnorderedElementsAre(19, 20, 21));
}

TEST(Appearance, AnswersTheSameHoweverLateItIsAsked) {
  Appearance seen(circling()), resumed(circling()), asked_late(circling());
  for (std::size_t k = 0; k < 3 * kLap / 2; ++k) {
    seen.see(k);
    if (k > kLap) resumed.see(k);
  }
  const std::size_t last = 3 * kLap / 2 - 1;
  EXPECT_EQ(asked_late.like(last, kLap, 5), seen.like(last, kLap, 5));
  EXPECT_EQ(resumed.like(last, kLap, 5), seen.like(last, kLap, 5));
}

TEST(Appearance, OldKeyframesAreReadOnlyWhenAskedFor) {
  int reads = 0;
  Appearance appearance(circling(&reads));
  for (std::size_t k = kLap; k < kLap + 20; ++k) appearance.see(k);
  EXPECT_EQ(reads, 0);
  appearance.like(kLap + 19, kLap, 3);
  EXPECT_EQ(reads, static_cast<int>(kLap + 20 + Appearance::kLearnFrom));
  appearance.see(kLap + 20);
  EXPECT_EQ(reads, static_cast<int>(kLap + 21 + Appearance::kLearnFrom));
}

TEST(Appearance, HasNoAnswersBeforeItHasSeenAnything) {
  Appearance appearance(circling());
  for (std::size_t k = 0; k + 1 < Appearance::kLearnFrom; ++k) {
    appearance.see(k);
    EXPECT_THAT(appearance.like(k, k, 3), IsEmpty());
  }
}

/// A lap and a bit whose odometry drifts to the side by 0.75 m per step, and says that it may.
struct BadLap {
  BadLap() : truth(test::circle(kLap + 1, 2.0)) {
    graph.add_keyframe(Pose());
    graph.add_prior(0, Pose(), test::isotropic(1e-4, 1e-3));
  }
  void advance() {
    const std::size_t k = graph.size();
    const Pose step = truth[(k - 1) % kLap].inverse() * truth[(k - 1) % kLap + 1];
    const Pose aside(Eigen::Quaterniond::Identity(), graph.T_map_body(k - 1).rotation().inverse() * kDrift_map_m);
    graph.add_keyframe(graph.T_map_body(k - 1) * aside * step);
    graph.add_odometry({k - 1, k, aside * step, test::isotropic(1e-3, 2.2)});
  }
  double error_m(std::size_t k) const {
    return (graph.T_map_body(k).translation() - truth[k % kLap].translation()).norm();
  }
  Motion seen(std::size_t i, std::size_t j) const {
    const Pose T_i_j = truth[i % kLap].inverse() * truth[j % kLap];
    if (T_i_j.translation().norm() > 5.0) return {.reason = "too few matches (3)"};
    return {.ok = true, .T_a_b = T_i_j, .covariance = test::isotropic(1e-3, 1e-2), .inliers = 100};
  }

  const Eigen::Vector3d kDrift_map_m{0.0, 0.75, 0.0};
  std::vector<Pose> truth;
  PoseGraph graph;
};

/// How far off the rover is where the lap ends.
double error_after_a_lap_m(const AppearanceSource& appearance) {
  BadLap lap;
  LoopClosure closure(
      {}, Pose(), [&](std::size_t i, std::size_t j, const Pose&) { return lap.seen(i, j); }, appearance);
  for (std::size_t k = 1; k < kLap + 5; ++k) {
    lap.advance();
    closure.close(lap.graph);
  }
  lap.graph.optimize();
  return lap.error_m(kLap);
}

TEST(Appearance, ClosesALoopThatThePositionCannotFind) {
  Appearance appearance(circling());
  EXPECT_GT(error_after_a_lap_m(nullptr), 59.0);
  EXPECT_LT(
      error_after_a_lap_m([&](std::size_t keyframe, std::size_t end) { return appearance.like(keyframe, end, 3); }),
      0.5);
}

}  // namespace
}  // namespace demslam
