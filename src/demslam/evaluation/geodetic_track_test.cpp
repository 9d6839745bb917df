#include "demslam/evaluation/geodetic_track.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "demslam/base/error.h"
#include "demslam/evaluation/trajectory_io.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::ThrowsMessage;

class GeodeticTrack : public testing::Test {
 protected:
  ~GeodeticTrack() override { fs::remove(file_); }
  std::vector<GeodeticFix> read(const std::string& text) const {
    std::ofstream(file_) << text;
    return read_pos(file_);
  }
  const fs::path file_ = fs::path(testing::TempDir()) /
                         (std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) + ".pos");
};

const std::string kHead =
    "% program   : RTKPOST ver.2.4.3\n%  GPST                  latitude(deg) longitude(deg)  height(m)   Q  ns   "
    "sdn(m)\n";
const std::string kFixed = "2021/07/07 11:28:10.200   37.700000000   15.000000000   2500.0000   1  12   0.01\n";

TEST_F(GeodeticTrack, TimesAreExactAndColumnsInTheirPlaces) {
  const auto fixes = read(kHead + kFixed);
  ASSERT_EQ(fixes.size(), 1U);
  EXPECT_EQ(fixes[0].t_ns, 1625657290200000000);
  EXPECT_DOUBLE_EQ(fixes[0].latitude_deg, 37.7);
  EXPECT_DOUBLE_EQ(fixes[0].longitude_deg, 15.0);
  EXPECT_DOUBLE_EQ(fixes[0].height_m, 2500.0);
  EXPECT_EQ(fixes[0].quality, 1);
}

TEST_F(GeodeticTrack, WhatCannotBeMeantIsRefused) {
  EXPECT_THAT([&] { read(kHead + kFixed + kFixed); }, ThrowsMessage<Error>(HasSubstr(":4: the times must increase")));
  EXPECT_THAT([&] { read("2165 380090.2 37.7 15 2500 1\n"); }, ThrowsMessage<Error>(HasSubstr("is no time like")));
  EXPECT_THAT([&] { read("2021/13/07 11:28:10 37.7 15 2500 1\n"); },
              ThrowsMessage<Error>(HasSubstr("is no time like")));
  EXPECT_THAT([&] { read("2021/07/07 11:28:10.2 37.7 15\n"); },
              ThrowsMessage<Error>(HasSubstr("a line must be date, time")));
  EXPECT_THAT([&] { read("2021/07/07 11:28:10.2 4173000.0 15.0 2500 1\n"); },
              ThrowsMessage<Error>(HasSubstr("must be degrees")));
  EXPECT_THAT([&] { read("%  GPST  x-baseline(m)  y-baseline(m)\n" + kFixed); },
              ThrowsMessage<Error>(HasSubstr("holds baselines")));
}

/// UTM 33 N: 15 degrees East is its central meridian, easting 500 km.
LocalFrame etna() {
  return {
      "PROJCS[\"WGS 84 / UTM zone 33N\",GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS "
      "84\",6378137,298.257223563]],"
      "PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433]],PROJECTION[\"Transverse_Mercator\"],"
      "PARAMETER[\"latitude_of_origin\",0],PARAMETER[\"central_meridian\",15],PARAMETER[\"scale_factor\",0.9996],"
      "PARAMETER[\"false_easting\",500000],PARAMETER[\"false_northing\",0],UNIT[\"metre\",1]]",
      {500000.0, 4172500.0, 2400.0}};
}

TEST_F(GeodeticTrack, FixesLieInTheDemsMapAboveItsGeoid) {
  const Georeference georeference(etna());
  const Trajectory track = positions_in_map(read(kHead + kFixed), georeference, {.geoid_undulation_m = 43.46});
  ASSERT_EQ(track.size(), 1U);
  EXPECT_FALSE(has_rotation(track));
  EXPECT_NEAR(track[0].pose.translation().x(), 0.0, 1e-3);
  EXPECT_NEAR(track[0].pose.translation().z(), 2500.0 - 43.46 - 2400.0, 1e-9);
  const Eigen::Vector3d back = georeference.lon_lat_height(track[0].pose.translation());
  EXPECT_NEAR(back.y(), 37.7, 1e-9);
}

TEST_F(GeodeticTrack, FixesOfPoorQualityAreLeftOut) {
  const auto fixes =
      read(kHead + kFixed + "2021/07/07 11:28:10.400 37.7 15 2500 2\n2021/07/07 11:28:10.600 37.7 15 2500 5\n");
  const Georeference georeference(etna());
  EXPECT_EQ(positions_in_map(fixes, georeference).size(), 1U);
  EXPECT_EQ(positions_in_map(fixes, georeference, {.worst_quality = 2}).size(), 2U);
  EXPECT_THAT([&] { positions_in_map(fixes, georeference, {.worst_quality = 0}); },
              ThrowsMessage<Error>(HasSubstr("none of the fixes")));
}

}  // namespace
}  // namespace demslam
