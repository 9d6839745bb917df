#include "demslam/odometry/bundle.h"

#include <gtest/gtest.h>

#include "demslam/odometry/synthetic_scene.h"

namespace demslam {
namespace {

using testing_scene::test_rig;

const StereoNoise kNoise{.a = {0.0, 0.0, 0.2}, .b = {0.2, 0.2, 0.2}};

Vector6d error_of(const Pose& estimate, const Pose& truth) { return (truth.inverse() * estimate).log(); }

/// Views half a metre apart in a bend; every view hosts landmarks, seen from all later views that have them in front.
Bundle true_bundle(int views, int landmarks_per_view, const StereoNoise& noise, Random& random,
                   double vergence_rad = 0.0) {
  RectifiedRig rig = test_rig();
  rig.vergence_rad = vergence_rad;
  Bundle bundle;
  Pose pose;
  for (int i = 0; i < views; ++i) {
    bundle.T_world_left.push_back(pose);
    pose = pose * Pose(rotation_from_rpy(0.0, 0.03, 0.01), {0.05, 0.0, 0.5});
  }
  for (int host = 0; host + 1 < views; ++host) {
    for (int k = 0; k < landmarks_per_view; ++k) {
      const StereoPixel pixel(random.uniform(0.0, 320.0), random.uniform(0.0, 240.0), random.uniform(2.0, 12.0));
      const int index = static_cast<int>(bundle.landmarks.size());
      StereoPixel measured = pixel;
      measured.z() += noise.a.z() * random.normal();
      bundle.landmarks.push_back({host, measured, measured.z()});
      for (int view = host + 1; view < views; ++view) {
        const Pose T_view_host = bundle.T_world_left[view].inverse() * bundle.T_world_left[host];
        const Eigen::Vector3d p = T_view_host * unproject(rig, pixel);
        if (p.z() < 0.5) continue;
        StereoPixel seen = project(rig, p);
        for (int i = 0; i < 3; ++i) seen[i] += noise.b[i] * random.normal();
        bundle.observations.push_back({index, view, seen});
      }
    }
  }
  return bundle;
}

void disturb(Bundle& bundle, double amount, Random& random) {
  for (std::size_t i = 1; i < bundle.T_world_left.size(); ++i) {
    Vector6d xi;
    for (int k = 0; k < 6; ++k) xi[k] = amount * random.normal();
    bundle.T_world_left[i] = bundle.T_world_left[i] * Pose::exp(xi);
  }
}

TEST(BundleError, AnalyticJacobiansAreTheNumericOnes) {
  RectifiedRig rig = test_rig();
  rig.vergence_rad = 0.003;
  const Pose T_world_host(rotation_from_rpy(0.1, 0.2, -0.1), {0.3, 0.1, 0.5});
  const Pose T_world_view = T_world_host * Pose(rotation_from_rpy(-0.05, 0.08, 0.02), {0.1, 0.2, 0.7});
  const StereoPixel host(70.0, 150.0, 6.0), seen(90.0, 140.0, 7.0);
  const BundleError at = bundle_error(rig, T_world_host, T_world_view, host, seen);
  const double h = 1e-6;
  for (int k = 0; k < 6; ++k) {
    const Pose plus = Pose::exp(h * Vector6d::Unit(k)), minus = Pose::exp(-h * Vector6d::Unit(k));
    const Eigen::Vector3d by_host = (bundle_error(rig, T_world_host * plus, T_world_view, host, seen).error -
                                     bundle_error(rig, T_world_host * minus, T_world_view, host, seen).error) /
                                    (2 * h);
    const Eigen::Vector3d by_view = (bundle_error(rig, T_world_host, T_world_view * plus, host, seen).error -
                                     bundle_error(rig, T_world_host, T_world_view * minus, host, seen).error) /
                                    (2 * h);
    EXPECT_LT((by_host - at.by_host.col(k)).norm(), 1e-5 * (1.0 + by_host.norm())) << k;
    EXPECT_LT((by_view - at.by_view.col(k)).norm(), 1e-5 * (1.0 + by_view.norm())) << k;
  }
  const Eigen::Vector3d step(0.0, 0.0, h);
  const Eigen::Vector3d by_disparity = (bundle_error(rig, T_world_host, T_world_view, host + step, seen).error -
                                        bundle_error(rig, T_world_host, T_world_view, host - step, seen).error) /
                                       (2 * h);
  EXPECT_LT((by_disparity - at.by_disparity).norm(), 1e-5 * (1.0 + by_disparity.norm()));
  const auto turned = [&](double vergence_rad) {
    RectifiedRig by = rig;
    by.vergence_rad += vergence_rad;
    return bundle_error(by, T_world_host, T_world_view, host, seen).error;
  };
  const Eigen::Vector3d by_vergence = (turned(h) - turned(-h)) / (2 * h);
  EXPECT_LT((by_vergence - at.by_vergence).norm(), 1e-5 * (1.0 + by_vergence.norm()));
}

TEST(OptimizeBundle, FindsTheExactPosesWithoutNoise) {
  Random random(1);
  const StereoNoise none{.a = Eigen::Vector3d::Zero(), .b = Eigen::Vector3d::Zero()};
  const Bundle truth = true_bundle(5, 40, none, random);
  Bundle bundle = truth;
  disturb(bundle, 0.02, random);
  const BundleReport report = optimize_bundle(test_rig(), kNoise, bundle);
  ASSERT_TRUE(report.ok);
  EXPECT_EQ(report.inliers, static_cast<int>(truth.observations.size()));
  for (int i = 0; i < 5; ++i) EXPECT_LT(error_of(bundle.T_world_left[i], truth.T_world_left[i]).norm(), 1e-5) << i;
}

TEST(OptimizeBundle, CovarianceIsTheScatterOfItsEstimates) {
  const int runs = 100;
  double nees = 0.0, relative_nees = 0.0;
  for (int run = 0; run < runs; ++run) {
    Random random(2, run);
    Bundle bundle = true_bundle(4, 60, kNoise, random);
    const std::vector<Pose> truth = bundle.T_world_left;
    const BundleReport report = optimize_bundle(test_rig(), kNoise, bundle);
    ASSERT_TRUE(report.ok);
    const Vector6d error = error_of(bundle.T_world_left[1], truth[1]);
    nees += error.dot(report.covariance.topLeftCorner<6, 6>().ldlt().solve(error)) / runs;
    const Vector6d relative =
        error_of(bundle.T_world_left[2].inverse() * bundle.T_world_left[3], truth[2].inverse() * truth[3]);
    relative_nees += relative.dot(relative_covariance(bundle, report, 2, 3).ldlt().solve(relative)) / runs;
  }
  // Six degrees of freedom; the Cauchy weights make the claim somewhat wide.
  EXPECT_GT(nees, 3.0);
  EXPECT_LT(nees, 7.5);
  EXPECT_GT(relative_nees, 3.0);
  EXPECT_LT(relative_nees, 7.5);
}

TEST(OptimizeBundle, BeatsTheChainOfPairs) {
  double window = 0.0, chain = 0.0;
  for (int run = 0; run < 20; ++run) {
    Random random(3, run);
    Bundle all = true_bundle(6, 60, kNoise, random);
    const std::vector<Pose> truth = all.T_world_left;
    Pose T_world_chained;
    for (int i = 0; i + 1 < 6; ++i) {
      Bundle pair;
      pair.T_world_left = {truth[i], truth[i + 1]};
      for (const BundleObservation& observation : all.observations) {
        const BundleLandmark& landmark = all.landmarks[observation.landmark];
        if (landmark.host != i || observation.view != i + 1) continue;
        pair.observations.push_back({static_cast<int>(pair.landmarks.size()), 1, observation.pixel});
        pair.landmarks.push_back({0, landmark.measured, landmark.disparity_px});
      }
      ASSERT_TRUE(optimize_bundle(test_rig(), kNoise, pair).ok);
      T_world_chained = T_world_chained * (pair.T_world_left[0].inverse() * pair.T_world_left[1]);
    }
    ASSERT_TRUE(optimize_bundle(test_rig(), kNoise, all).ok);
    chain += (T_world_chained.translation() - truth[5].translation()).squaredNorm();
    window += (all.T_world_left[5].translation() - truth[5].translation()).squaredNorm();
  }
  EXPECT_LT(std::sqrt(window), 0.6 * std::sqrt(chain));
}

TEST(OptimizeBundle, PointsOutWrongObservations) {
  Random random(4);
  Bundle bundle = true_bundle(4, 40, kNoise, random);
  const std::vector<Pose> truth = bundle.T_world_left;
  for (int i = 0; i < 10; ++i) bundle.observations[7 * i].pixel.x() += 12.0;
  const BundleReport report = optimize_bundle(test_rig(), kNoise, bundle);
  ASSERT_TRUE(report.ok);
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(report.inlier[7 * i]) << i;
  EXPECT_LT(error_of(bundle.T_world_left[3], truth[3]).norm(), 0.03);
}

TEST(OptimizeBundle, FindsTheVergence) {
  const double truth_rad = 1e-3;
  double nees = 0.0;
  const int runs = 30;
  for (int run = 0; run < runs; ++run) {
    Random random(6, run);
    Bundle bundle = true_bundle(5, 100, kNoise, random, truth_rad);
    bundle.vergence = {.rad = 0.0, .variance_rad2 = 1e-6};
    const std::vector<Pose> truth = bundle.T_world_left;
    Bundle blind = bundle;
    blind.vergence = {};
    const BundleReport report = optimize_bundle(test_rig(), kNoise, bundle);
    ASSERT_TRUE(report.ok);
    EXPECT_LT(report.vergence.sigma_rad(), 0.3 * truth_rad);
    EXPECT_EQ(report.covariance.rows(), 24);
    nees += std::pow(report.vergence.rad - truth_rad, 2) / report.vergence.variance_rad2 / runs;
    ASSERT_TRUE(optimize_bundle(test_rig(), kNoise, blind).ok);
    EXPECT_EQ(blind.vergence_rad, 0.0);
    const double length = truth[4].translation().norm();
    EXPECT_GT(std::abs(blind.T_world_left[4].translation().norm() / length - 1.0), 0.015) << run;
    EXPECT_LT(std::abs(bundle.T_world_left[4].translation().norm() / length - 1.0), 0.015) << run;
  }
  EXPECT_GT(nees, 0.4);
  EXPECT_LT(nees, 1.8);
}

TEST(OptimizeBundle, RefusesViewsThatDoNotHangTogether) {
  Random random(5);
  Bundle bundle = true_bundle(3, 20, kNoise, random);
  std::erase_if(bundle.observations, [](const BundleObservation& observation) { return observation.view == 2; });
  std::erase_if(bundle.observations,
                [&](const BundleObservation& o) { return bundle.landmarks[o.landmark].host == 2; });
  const Bundle before = bundle;
  EXPECT_FALSE(optimize_bundle(test_rig(), kNoise, bundle).ok);
  EXPECT_EQ(bundle.T_world_left[1].matrix(), before.T_world_left[1].matrix());
}

}  // namespace
}  // namespace demslam
