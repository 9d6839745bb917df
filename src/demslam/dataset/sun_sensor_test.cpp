#include "demslam/dataset/sun_sensor.h"

#include <gtest/gtest.h>

#include "demslam/base/error.h"
#include "demslam/base/text.h"

namespace demslam {
namespace {

std::filesystem::path file_with(const std::string& text) {
  const auto file = std::filesystem::path(testing::TempDir()) / "sun.csv";
  write_text(file, text);
  return file;
}

TEST(SunSensor, ReadsDirectionsInTheBodyAndInTheMapWhereThereAre) {
  const auto sun = read_sun(file_with("100, 2, 0, 0, 0.3\n200, 0, 1, 0, 0.5, 0, 0, 3\n"));
  ASSERT_EQ(sun.size(), 2U);
  EXPECT_EQ(sun[0].sun_body, Eigen::Vector3d::UnitX());
  EXPECT_FALSE(sun[0].sun_map.has_value());
  EXPECT_EQ(*sun[1].sun_map, Eigen::Vector3d::UnitZ());
  EXPECT_EQ(sun[1].sigma_deg, 0.5);
}

TEST(SunSensor, RefusesWhatIsNoDirectionAndStampsThatDoNotIncrease) {
  EXPECT_THROW(read_sun(file_with("100, 0, 0, 0, 0.3\n")), Error);
  EXPECT_THROW(read_sun(file_with("100, 1, 0, 0\n")), Error);
  EXPECT_THROW(read_sun(file_with("100, 1, 0, 0, 0\n")), Error);
  EXPECT_THROW(read_sun(file_with("100, 1, 0, 0, 1\n100, 1, 0, 0, 1\n")), Error);
}

}  // namespace
}  // namespace demslam
