#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "demslam/base/error.h"
#include "demslam/report/map_picture.h"
#include "demslam/report/svg_plot.h"

namespace demslam {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

Dem flat_dem() {
  DemRaster raster{.rows = 40, .cols = 40, .cell_m = 5.0, .west_m = -100.0, .north_m = 100.0};
  raster.heights.assign(1600, 0.0F);
  return Dem(raster);
}

Trajectory eastward(double length_m) {
  Trajectory trajectory;
  for (double x = 0.0; x <= length_m; x += 1.0) {
    trajectory.push_back({0, Pose(Eigen::Quaterniond::Identity(), {x, 0.0, 0.0})});
  }
  return trajectory;
}

TEST(RoundTicks, AreOneTwoOrFiveApart) {
  EXPECT_THAT(round_ticks(0.0, 1.0, 5), ElementsAre(0.0, testing::DoubleNear(0.2, 1e-12),
                                                    testing::DoubleNear(0.4, 1e-12), testing::DoubleNear(0.6, 1e-12),
                                                    testing::DoubleNear(0.8, 1e-12), testing::DoubleNear(1.0, 1e-12)));
  EXPECT_GE(round_ticks(0.0, 37.0, 5).back(), 37.0);
}

TEST(SvgPlot, DrawsEverySeriesWithItsLabelAndTheUnits) {
  const std::string svg =
      to_svg({"Error", "distance [m]", "error [m]", {{"odometry", "#c00", {{0.0, 0.0}, {10.0, 2.0}}}}});
  EXPECT_THAT(svg, testing::AllOf(HasSubstr("<polyline"), HasSubstr("odometry"), HasSubstr("distance [m]")));
}

TEST(SvgPlot, HasDecadesOnALogarithmicAxisAndLeavesOutWhatIsNotPositive) {
  const std::string svg =
      to_svg({.title = "Error", .series = {{"both", "#c00", {{0.0, 0.0}, {5.0, 0.02}, {10.0, 300.0}}}}, .log_y = true});
  for (const char* tick : {">0.01<", ">0.1<", ">1<", ">10<", ">100<", ">1000<"}) EXPECT_THAT(svg, HasSubstr(tick));
  const std::string points = svg.substr(svg.find("points=\""));
  EXPECT_EQ(std::ranges::count(points.substr(0, points.find("/>")), ','), 2);
}

TEST(MapPicture, ShowsTheTrackInItsColourOverTheTerrain) {
  const Colour red{220, 30, 30};
  const Canvas canvas = draw_map_picture(flat_dem(), {{"odometry", red, eastward(50.0)}}, {.width = 600});
  int reds = 0, greys = 0;
  for (int v = canvas.height() / 3; v < canvas.height() * 2 / 3; ++v) {
    for (int u = 0; u < canvas.width(); ++u) {
      const Colour c = canvas.at(u, v);
      reds += c.red == red.red && c.green == red.green;
      greys += c.red == c.green && c.green == c.blue;
    }
  }
  EXPECT_GT(reds, 300);
  EXPECT_GT(greys, 10000);
}

TEST(MapPicture, PutsNorthUp) {
  Trajectory north;
  for (double y = 0.0; y <= 50.0; y += 1.0) north.push_back({0, Pose(Eigen::Quaterniond::Identity(), {0.0, y, 0.0})});
  const Colour green{10, 200, 10};
  const Canvas canvas = draw_map_picture(flat_dem(), {{"", green, north}}, {.width = 600});
  int first = -1, last = -1;  // the end point is a filled disc in the track's colour, the start a white one
  for (int v = 0; v < canvas.height(); ++v) {
    for (int u = canvas.width() / 2 - 2; u <= canvas.width() / 2 + 2; ++u) {
      if (canvas.at(u, v).green != green.green || canvas.at(u, v).red != green.red) continue;
      if (first < 0) first = v;
      last = v;
    }
  }
  EXPECT_LT(first, canvas.height() / 2);
  EXPECT_GT(last, first + 100);
}

TEST(MapPicture, RefusesToDrawNothing) {
  EXPECT_THROW({ auto canvas = draw_map_picture(flat_dem(), {}, {}); }, Error);
}

}  // namespace
}  // namespace demslam
