#include "demslam/slam/relocalisation.h"

#include <gtest/gtest.h>

#include "demslam/slam/feature_cache.h"

namespace demslam {
namespace {

const Pose kT_body_left(R_body_camera_level(), {0.3, 0.1, 1.0});

Pose truth(std::size_t keyframe) {
  return Pose(Eigen::Quaterniond::Identity(), {2.0 * static_cast<double>(keyframe), 0.0, 0.0});
}

/// Keyframes 0 to 7 along a line; behind keyframe 6 the rover was lost and is believed 2 m off.
PoseGraph lost_graph() {
  PoseGraph graph;
  graph.add_keyframe(truth(0));
  graph.add_prior(0, truth(0), 1e-6 * Matrix6d::Identity());
  for (std::size_t k = 1; k < 8; ++k) {
    const Pose T_i_j = k < 7 ? truth(1) : Pose(Eigen::Quaterniond::Identity(), {2.0, 2.0, 0.0});
    graph.add_keyframe(graph.T_map_body(k - 1) * T_i_j);
    graph.add_odometry({k - 1, k, T_i_j, (k < 7 ? 1e-6 : 1.0) * Matrix6d::Identity()});
  }
  return graph;
}

/// Only keyframe 3 shows the same ground as the newest one.
Motion seen_from_three(std::size_t old_view, const Pose&) {
  if (old_view != 3) return {.reason = "too few matches (3)"};
  const Pose T_old_new = truth(3).inverse() * truth(7);
  return {.ok = true,
          .T_a_b = kT_body_left.inverse() * T_old_new * kT_body_left,
          .covariance = 1e-6 * Matrix6d::Identity(),
          .inliers = 80};
}

TEST(Relocaliser, TiesTheKeyframeBehindALossToAnOlderOne) {
  PoseGraph graph = lost_graph();
  Relocaliser relocaliser({}, kT_body_left);
  const auto tried = relocaliser.look(graph, true, seen_from_three);
  EXPECT_EQ(relocaliser.found(), 1);
  EXPECT_EQ(tried.back().measurement.i, 3U);
  graph.optimize();
  EXPECT_LT((graph.T_map_body(7).translation() - truth(7).translation()).norm(), 0.01);
}

TEST(Relocaliser, GivesUpAfterAFewKeyframes) {
  PoseGraph graph = lost_graph();
  Relocaliser relocaliser({}, kT_body_left);
  const auto sees_nothing = [](std::size_t, const Pose&) { return Motion{.reason = "too few matches (0)"}; };
  EXPECT_EQ(relocaliser.look(graph, true, sees_nothing).size(), Relocaliser::kBefore - 1);
  for (std::size_t k = 8; k < 8 + Relocaliser::kTries; ++k) {
    graph.add_keyframe(graph.T_map_body(k - 1) * truth(1));
    graph.add_odometry({k - 1, k, truth(1), 1e-6 * Matrix6d::Identity()});
    relocaliser.look(graph, false, sees_nothing);
  }
  EXPECT_TRUE(relocaliser.look(graph, false, seen_from_three).empty());
  EXPECT_EQ(relocaliser.found(), 0);
}

TEST(Relocaliser, DoesNothingWithoutALoss) {
  PoseGraph graph = lost_graph();
  EXPECT_TRUE(Relocaliser({}, kT_body_left).look(graph, false, seen_from_three).empty());
}

TEST(FeatureCache, KeepsTheLastUsedAndReadsTheOthersAgain) {
  int reads = 0;
  FeatureCache cache([&](std::size_t) {
    ++reads;
    return std::make_shared<const StereoFeatures>();
  });
  for (std::size_t k = 0; k < 2 * FeatureCache::kCapacity; ++k) cache.add(k, std::make_shared<StereoFeatures>());
  EXPECT_TRUE(cache.at(2 * FeatureCache::kCapacity - 1));
  EXPECT_EQ(reads, 0);
  EXPECT_TRUE(cache.at(0));
  EXPECT_TRUE(cache.at(0));
  EXPECT_EQ(reads, 1);
}

TEST(FeatureCache, AGlanceTakesNoOthersPlace) {
  int reads = 0;
  FeatureCache cache([&](std::size_t) {
    ++reads;
    return std::make_shared<const StereoFeatures>();
  });
  cache.add(100, std::make_shared<StereoFeatures>());
  for (std::size_t k = 0; k < 2 * FeatureCache::kCapacity; ++k) EXPECT_TRUE(cache.glance_at(k));
  EXPECT_EQ(reads, static_cast<int>(2 * FeatureCache::kCapacity));
  EXPECT_TRUE(cache.at(100));
  EXPECT_TRUE(cache.glance_at(100));
  EXPECT_EQ(reads, static_cast<int>(2 * FeatureCache::kCapacity));
}

TEST(FeatureCache, KeepsEverythingWithoutAStore) {
  FeatureCache cache(nullptr);
  for (std::size_t k = 0; k < 100; ++k) cache.add(k, std::make_shared<StereoFeatures>());
  EXPECT_TRUE(cache.at(0));
  EXPECT_FALSE(cache.at(100));
}

}  // namespace
}  // namespace demslam
