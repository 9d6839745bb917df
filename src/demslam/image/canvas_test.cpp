#include "demslam/image/canvas.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "demslam/base/error.h"

namespace demslam {
namespace {

constexpr Colour kRed{255, 0, 0}, kWhite{255, 255, 255};

void expect_colour(Colour actual, Colour expected) {
  EXPECT_EQ(actual.red, expected.red);
  EXPECT_EQ(actual.green, expected.green);
  EXPECT_EQ(actual.blue, expected.blue);
}

TEST(Canvas, StartsInItsBackground) { expect_colour(Canvas(8, 4, {1, 2, 3}).at(7, 3), {1, 2, 3}); }

TEST(Canvas, PolylinePassesThroughItsVerticesAndNowhereElse) {
  Canvas canvas(40, 40);
  const std::array<Eigen::Vector2d, 3> points{Eigen::Vector2d(5, 5), Eigen::Vector2d(30, 5), Eigen::Vector2d(30, 30)};
  canvas.polyline(points, kRed, 3);
  expect_colour(canvas.at(15, 5), kRed);
  expect_colour(canvas.at(30, 20), kRed);
  expect_colour(canvas.at(15, 20), kWhite);
}

TEST(Canvas, CircleIsFilledWhereTheThicknessIsNegative) {
  Canvas canvas(40, 40);
  canvas.circle({10, 20}, 6, kRed, -1);
  canvas.circle({30, 20}, 6, kRed, 1);
  expect_colour(canvas.at(10, 20), kRed);
  expect_colour(canvas.at(30, 20), kWhite);
}

TEST(Canvas, RasterIsScaledAndItsHolesShowTheBackground) {
  Canvas canvas(10, 10, kRed);
  const float hole = std::numeric_limits<float>::quiet_NaN();
  const std::array<float, 4> values{10.0F, 20.0F, hole, 30.0F};
  canvas.draw(values, 2, 10.0F, 20.0F, 1, 1, 2.0);
  expect_colour(canvas.at(1, 1), {0, 0, 0});
  expect_colour(canvas.at(4, 2), kWhite);
  expect_colour(canvas.at(2, 4), kRed);
  expect_colour(canvas.at(4, 4), kWhite);
}

TEST(Canvas, WhatFallsOutsideIsCutOff) {
  Canvas canvas(10, 10);
  canvas.draw(Image(20, 20, 0), -15, -15);
  canvas.line({-1e9, 9}, {1e9, 9}, kRed);
  expect_colour(canvas.at(4, 4), {0, 0, 0});
  expect_colour(canvas.at(5, 5), kWhite);
}

TEST(Canvas, TextTakesTheRoomItSays) {
  Canvas canvas(200, 60);
  const Eigen::Vector2d size = Canvas::text_size("drift 0.3 %", 0.6);
  canvas.text("drift 0.3 %", {10, 40}, {0, 0, 0}, 0.6);
  int leftmost = 200, rightmost = 0;
  for (int v = 0; v < 60; ++v) {
    for (int u = 0; u < 200; ++u) {
      if (canvas.at(u, v).red > 128) continue;
      leftmost = std::min(leftmost, u);
      rightmost = std::max(rightmost, u);
    }
  }
  EXPECT_NEAR(rightmost - leftmost, size.x(), 6.0);
}

TEST(Canvas, WritesAPictureThatReadsBack) {
  const auto file = std::filesystem::temp_directory_path() / "demslam_canvas_test.png";
  Canvas(12, 9, {100, 100, 100}).write(file);
  EXPECT_EQ(read_image(file).at(3, 3), 100);
  std::filesystem::remove(file);
  EXPECT_THROW(Canvas(2, 2).write("picture.nothing"), Error);
}

}  // namespace
}  // namespace demslam
