#include "demslam/anchoring/anchor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>

#include "demslam/anchoring/factor_kind.h"

namespace demslam {
namespace {

const Eigen::Vector3d kLever(0.0, 0.0, -1.0);

/// Waves of 100 m length and 3 m height, 200 m square.
DemRaster waves(double cell_m = 5.0) {
  const int cells = static_cast<int>(200.0 / cell_m);
  DemRaster dem{.rows = cells, .cols = cells, .cell_m = cell_m, .west_m = -100.0, .north_m = 100.0};
  for (int row = 0; row < cells; ++row) {
    for (int col = 0; col < cells; ++col) {
      const Eigen::Vector2d p = dem.centre(row, col);
      dem.heights.push_back(static_cast<float>(3.0 * std::sin(p.x() * 0.0628) * std::cos(p.y() * 0.0628)));
    }
  }
  return dem;
}

/// Forty keyframes 3 m apart, eastwards on the true terrain; odometry that climbs 2 cm too much at every step.
PoseGraph climbing(const Dem& dem) {
  Vector6d sigma;
  sigma << 1e-3, 1e-3, 1e-3, 0.03, 0.03, 0.03;
  const Matrix6d covariance = sigma.cwiseAbs2().asDiagonal();
  PoseGraph graph;
  std::vector<Pose> truth;
  for (int k = 0; k < 40; ++k) {
    const double x = -60.0 + 3.0 * k;
    truth.emplace_back(Eigen::Quaterniond::Identity(), Eigen::Vector3d(x, 10.0, *dem.height(x, 10.0) + 1.0));
    const Pose climb(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.0, 0.0, 0.02));
    if (k == 0) {
      graph.add_keyframe(truth[0]);
      graph.add_prior(0, truth[0], 1e-6 * Matrix6d::Identity());
      continue;
    }
    const Pose step = truth[k - 1].inverse() * truth[k] * climb;
    graph.add_keyframe(graph.T_map_body(k - 1) * step);
    graph.add_odometry({static_cast<std::size_t>(k - 1), static_cast<std::size_t>(k), step, covariance});
  }
  return graph;
}

double end_height_error_m(const PoseGraph& graph, const Dem& dem) {
  const Eigen::Vector3d p = graph.T_map_body(39).translation();
  return p.z() - 1.0 - *dem.height(p.x(), p.y());
}

TEST(DemAnchor, BringsADriftingHeightBackToTheTerrain) {
  const auto dem = std::make_shared<Dem>(waves());
  for (const bool full : {true, false}) {
    PoseGraph graph = climbing(*dem);
    EXPECT_NEAR(end_height_error_m(graph, *dem), 0.78, 0.02);
    add_dem_factors(graph, dem, {.sigma_dem_m = 0.1, .sigma_contact_m = 0.0, .normal = false, .full_gradient = full},
                    kLever);
    graph.optimize();
    EXPECT_NEAR(end_height_error_m(graph, *dem), 0.0, 0.1);
  }
}

TEST(DemAnchor, EachFactorHasItsResidualInItsOwnStandardDeviationsWhateverTheKernelAndTheShift) {
  const auto dem = std::make_shared<Dem>(waves());
  for (const double sigma_shift_m : {0.0, 5.0}) {
    PoseGraph graph = climbing(*dem);
    add_dem_factors(graph, dem,
                    {.sigma_dem_m = 0.1,
                     .alike_errors = false,
                     .sigma_contact_m = 0.0,
                     .normal = false,
                     .gate = false,
                     .sigma_bias_m = sigma_shift_m,
                     .sigma_shift_m = sigma_shift_m},
                    kLever);
    std::map<std::string, std::vector<FactorResidual>> residuals;
    for (const FactorResidual& r : graph.residuals(factor_kind)) residuals[r.kind].push_back(r);
    EXPECT_EQ(residuals["prior"].size(), 1U);
    ASSERT_EQ(residuals["dem_height"].size(), 20U);  // every second keyframe
    const FactorResidual& last = residuals["dem_height"].back();
    EXPECT_EQ(last.rows, 1U);
    EXPECT_EQ(last.keyframe, 38U);
    EXPECT_NEAR(std::sqrt(last.chi_square), 0.02 * 38 / 0.1, 0.1);
  }
}

/// What all height factors on a climbing graph say about its height, in chi-square.
double height_evidence(double spacing_m, bool alike_errors) {
  const auto dem = std::make_shared<Dem>(waves());
  PoseGraph graph = climbing(*dem);
  add_dem_factors(graph, dem,
                  {.spacing_m = spacing_m,
                   .dem_correlation_m = 30.0,
                   .alike_errors = alike_errors,
                   .sigma_contact_m = 0.0,
                   .normal = false,
                   .gate = false},
                  kLever);
  double sum = 0.0;
  for (const FactorResidual& r : graph.residuals(factor_kind)) sum += r.kind == "dem_height" ? r.chi_square : 0.0;
  return sum;
}

TEST(DemAnchor, MoreHeightsOnTheSameErrorOfTheDemTellNoMore) {
  EXPECT_NEAR(height_evidence(3.0, false) / height_evidence(9.0, false), 3.0, 0.4);
  EXPECT_NEAR(height_evidence(3.0, true) / height_evidence(9.0, true), 1.0, 0.15);
}

TEST(DemAnchor, AnchorsOncePerSpacingAndEachKeyframeOnce) {
  const auto dem = std::make_shared<Dem>(waves());
  PoseGraph graph = climbing(*dem);
  DemAnchor anchor(dem, {.spacing_m = 9.0, .max_tilt_deg = 60.0}, kLever);
  anchor.update(graph);
  anchor.update(graph);
  EXPECT_EQ(anchor.report().height, 14);  // keyframes 0, 3, 6, ... 39
  EXPECT_EQ(anchor.report().normal, 14);
}

TEST(DemAnchor, PatchesAreAsFineAsTheDem) {
  const auto cells_on = [](double dem_cell_m) {
    const auto dem = std::make_shared<Dem>(waves(dem_cell_m));
    PoseGraph graph = climbing(*dem);
    DemAnchor anchor(dem, {.patches = true}, kLever);
    for (std::size_t k = 0; k < graph.size(); ++k) {
      KeyframeLandmarks seen{.keyframe = k};
      for (int i = 0; i < 300; ++i) {
        const Eigen::Vector2d p = graph.T_map_body(k).translation().head<2>() + Eigen::Vector2d(i % 20, i / 20);
        const Eigen::Vector3d on_ground(p.x(), p.y(), dem->height(p.x(), p.y()).value_or(0.0));
        seen.points.push_back({graph.T_map_body(k).inverse() * on_ground, 1e-4 * Eigen::Matrix3d::Identity()});
      }
      anchor.add_landmarks(std::move(seen));
    }
    anchor.update(graph);
    return anchor.report().patch_cells;
  };
  EXPECT_GT(cells_on(5.0), 50);
  EXPECT_GT(cells_on(1.0), 5 * cells_on(5.0));
  EXPECT_EQ(cells_on(10.0), cells_on(5.0));
}

TEST(DemAnchor, BelievesNoSlopeBelowTheDemsOwnError) {
  const auto dem = std::make_shared<Dem>(waves());
  PoseGraph graph = climbing(*dem);
  const AnchoringReport sure = add_dem_factors(graph, dem, {.sigma_dem_m = 0.01, .normal = false}, kLever);
  const AnchoringReport unsure = add_dem_factors(graph, dem, {.sigma_dem_m = 5.0, .normal = false}, kLever);
  EXPECT_LT(sure.gated_heights, sure.height / 4);
  EXPECT_EQ(unsure.gated_heights, unsure.height);
}

TEST(DemAnchor, GivesNoNormalWhereThePlaceIsTooVague) {
  const auto dem = std::make_shared<Dem>(waves());
  PoseGraph graph;
  graph.add_keyframe(Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(25.0, 0.0, 1.0)));
  graph.add_prior(0, graph.T_map_body(0), 2500.0 * Matrix6d::Identity());
  EXPECT_EQ(add_dem_factors(graph, dem, {}, kLever).skipped_vague, 1);
}

TEST(DemAnchor, CountsWhatLiesOutsideOrInHoles) {
  DemRaster holed = waves();
  for (int col = 0; col < 20; ++col) holed.at(17, col) = std::numeric_limits<float>::quiet_NaN();
  const auto dem = std::make_shared<Dem>(waves());
  PoseGraph graph = climbing(*dem);
  const AnchoringReport report = add_dem_factors(graph, std::make_shared<Dem>(holed), {.spacing_m = 3.0}, kLever);
  EXPECT_GT(report.skipped_outside, 15);
  EXPECT_EQ(report.skipped_outside + report.height, 40);
}

TEST(DemAnchor, GivesAnOverturnedKeyframeNoNormal) {
  const auto dem = std::make_shared<Dem>(waves());
  PoseGraph graph;
  graph.add_keyframe(Pose(rotation_from_rpy(3.0, 0.0, 0.0), Eigen::Vector3d(0.0, 0.0, 1.0)));
  const AnchoringReport report = add_dem_factors(graph, dem, {}, kLever);
  EXPECT_EQ(report.skipped_tilt, 1);
  EXPECT_EQ(report.normal, 0);
  EXPECT_EQ(report.height, 1);
}

}  // namespace
}  // namespace demslam
