#include "demslam/dataset/sensors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "demslam/base/error.h"
#include "demslam/dataset/test_folder.h"

namespace demslam {
namespace {

using test::TestFolder;
using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(Sensors, ALidarScanHasPointsAndCategories) {
  const TestFolder folder;
  const auto points = read_lidar_scan(folder.text("1.txt", "1.5,-2,0.25,-1\n3,4,5,174\n"));
  ASSERT_EQ(points.size(), 2U);
  EXPECT_EQ(points[0].p_sensor, Eigen::Vector3d(1.5, -2.0, 0.25));
  EXPECT_EQ(points[0].category, -1);
  EXPECT_EQ(points[1].category, 174);
  EXPECT_TRUE(read_lidar_scan(folder.text("2.txt", "")).empty());
  EXPECT_THAT([&] { read_lidar_scan(folder.text("3.txt", "1,2,3,0\n1,2,3\n")); },
              ThrowsMessage<Error>(HasSubstr("3.txt:2: ")));
}

TEST(Sensors, ImuSamplesKeepTheirOrderOfColumns) {
  const TestFolder folder;
  const auto samples =
      read_imu(folder.text("imu.txt", "#t\n1403715273262142976,1,2,3,4,5,6\n1403715273267142912,0,0,0,0,0,9.8\n"));
  ASSERT_EQ(samples.size(), 2U);
  EXPECT_EQ(samples[0].t_ns, 1403715273262142976);
  EXPECT_EQ(samples[0].angular_rate_rad_s, Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_EQ(samples[0].acceleration_m_s2, Eigen::Vector3d(4.0, 5.0, 6.0));
  EXPECT_THAT([&] { read_imu(folder.text("b.txt", "2,0,0,0,0,0,0\n1,0,0,0,0,0,0\n")); },
              ThrowsMessage<Error>(HasSubstr("b.txt:2: the stamps must increase")));
}

TEST(Sensors, ManyImuSamplesBecomeMeansOverPeriods) {
  const TestFolder folder;
  std::string text;
  for (int i = 0; i < 12000; ++i) text += std::to_string(i * 10) + "," + std::to_string(i % 10) + ",0,0,0,0,2\n";
  const std::filesystem::path file = folder.text("imu.txt", text);
  EXPECT_EQ(read_imu(file).size(), 12000U);
  const auto means = read_imu(file, 100);
  ASSERT_EQ(means.size(), 1200U);
  EXPECT_EQ(means[1].t_ns, 145);
  EXPECT_DOUBLE_EQ(means[1].angular_rate_rad_s.x(), 4.5);
  EXPECT_DOUBLE_EQ(means[1199].acceleration_m_s2.z(), 2.0);
  EXPECT_THAT([&] { read_imu(folder.text("b.txt", text + "7,0,0,0,0,0,0\n"), 100); },
              ThrowsMessage<Error>(HasSubstr("b.txt:12001: the stamps must increase")));
}

TEST(Sensors, WheelsRollOn) {
  const TestFolder folder;
  const auto samples = read_wheels(folder.text("wheels.txt", "#t, left, right\n10,0.1,0.2\n20,0.3,0.4\n"));
  ASSERT_EQ(samples.size(), 2U);
  EXPECT_EQ(samples[1].t_ns, 20);
  EXPECT_EQ(samples[1].left_m, 0.3);
  EXPECT_EQ(samples[1].right_m, 0.4);
  EXPECT_THAT([&] { read_wheels(folder.text("b.txt", "1,2\n")); }, ThrowsMessage<Error>(HasSubstr("b.txt:1: ")));
}

/// 2x2, bottom row first: bottom 1, 2; top 3, 65504.
const std::string kFloats("\x00\x00\x80\x3f\x00\x00\x00\x40\x00\x00\x40\x40\x00\xe0\x7f\x47", 16);

TEST(Sensors, APfmIsTurnedTopRowFirst) {
  const TestFolder folder;
  const DepthImage image = read_pfm(folder.text("d.pfm", "Pf\n2 2\n-1.0\n" + kFloats));
  EXPECT_EQ(image.at(0, 0), 3.0F);
  EXPECT_EQ(image.at(1, 0), 65504.0F);
  EXPECT_EQ(image.at(0, 1), 1.0F);
  EXPECT_EQ(image.at(1, 1), 2.0F);
}

TEST(Sensors, ABrokenPfmIsRefused) {
  const TestFolder folder;
  const auto reading = [&](const std::string& bytes) {
    return [&folder, bytes] { read_pfm(folder.text("d.pfm", bytes)); };
  };
  EXPECT_THAT(reading("Pf\n2 2\n-1.0\n" + kFloats.substr(1)), ThrowsMessage<Error>(HasSubstr("the file is damaged")));
  EXPECT_THAT(reading("PF\n2 2\n-1.0\n" + kFloats), ThrowsMessage<Error>(HasSubstr("no PFM with one channel")));
  EXPECT_THAT(reading("P"), ThrowsMessage<Error>(HasSubstr("no PFM with one channel")));
}

}  // namespace
}  // namespace demslam
