#include "demslam/sim/surveyed_ground.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "demslam/sim/dem_product.h"

namespace demslam {
namespace {

TEST(SurveyedGround, IsTheGroundNearTheDriveAndAHoleElsewhere) {
  SceneOptions scene;
  scene.terrain.size_m = 300.0;
  scene.terrain.rock_abundance = 0.0;
  scene.terrain.tracks = false;
  scene.rover.length_m = 12.0;
  Mission mission(scene);
  const BuiltDem survey = surveyed_ground(mission, 4.0, {.cell_m = 1.0});
  const DemRaster truth = averaged_ground(mission.terrain(), mission.trajectory(), {.cell_m = 1.0, .margin_m = 60.0});

  std::vector<double> errors;
  double farthest_m = 0.0;
  for (int row = 0; row < truth.rows; ++row) {
    for (int col = 0; col < truth.cols; ++col) {
      const Eigen::Vector2d p = truth.centre(row, col);
      const int survey_row = static_cast<int>(std::floor((survey.heights.north_m - p.y()) / survey.heights.cell_m)),
                survey_col = static_cast<int>(std::floor((p.x() - survey.heights.west_m) / survey.heights.cell_m));
      if (survey_row < 0 || survey_row >= survey.heights.rows || survey_col < 0 || survey_col >= survey.heights.cols)
        continue;
      const float height_m = survey.heights.at(survey_row, survey_col);
      if (!std::isfinite(height_m)) continue;
      errors.push_back(std::abs(height_m - truth.at(row, col)));
      double away_m = 1e9;
      for (const StampedPose& stamped : mission.trajectory())
        away_m = std::min(away_m, (p - stamped.pose.translation().head<2>()).norm());
      farthest_m = std::max(farthest_m, away_m);
    }
  }
  ASSERT_GT(errors.size(), 500U);
  std::ranges::nth_element(errors, errors.begin() + std::ssize(errors) * 9 / 10);
  EXPECT_LT(errors[errors.size() * 9 / 10], 0.1);  // most cells are seen in part only
  EXPECT_LT(farthest_m, 32.0);                     // the LiDAR's range, and half a cell
}

}  // namespace
}  // namespace demslam
