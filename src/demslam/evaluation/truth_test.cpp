#include "demslam/evaluation/truth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <set>

#include "demslam/base/error.h"
#include "demslam/dem/dem.h"
#include "demslam/evaluation/export.h"
#include "demslam/evaluation/geodetic_track.h"
#include "demslam/evaluation/runs.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr double kUndulation_m = 43.46, kAntenna_m = 1.5, kClock_s = 16.7;

/// A figure of eight on a flat DSM of Etna (UTM 33 N, heights above the geoid), one pose a second; its satellite truth
/// with an antenna 1.5 m up and GPS time.
class GeodeticTruth : public testing::Test {
 protected:
  GeodeticTruth() {
    fs::create_directories(folder_);
    dem_.frame = {crs_wkt_of("EPSG:32633"), {500000.0, 4177000.0, 2400.0}};
    dem_.heights.assign(60 * 60, 0.0F);
    write_dem(folder_ / "dsm.tif", dem_);
    for (int i = 0; i < 60; ++i) {
      const double angle = 0.1 * i;
      drive_.push_back(
          {(1'625'657'690LL + i) * 1'000'000'000LL, Pose(rotation_from_rpy(0.0, 0.0, angle + 1.57),
                                                         {40.0 * std::cos(angle), 20.0 * std::sin(2.0 * angle), 0.0})});
    }
    std::ofstream(folder_ / "run.tum") << tum_text(drive_);
    std::ofstream(truth_) << pos_text();
  }
  ~GeodeticTruth() override { fs::remove_all(folder_); }

  Eigen::Vector3d lon_lat_height(const StampedPose& stamped) const {
    return Georeference(dem_.frame).lon_lat_height(stamped.pose.translation());
  }
  std::string pos_text() const {
    std::string text = "%  GPST                  latitude(deg) longitude(deg)  height(m)   Q  ns\n";
    for (std::size_t i = 0; i < drive_.size(); ++i) {
      const Eigen::Vector3d p = lon_lat_height(drive_[i]);
      const int tenths = 67 + 10 * static_cast<int>(i);  // since 11:35:00: the drive begins at 11:34:50, 16.7 s earlier
      char line[160];
      std::snprintf(line, sizeof line, "2021/07/07 11:%02d:%06.3f   %.10f   %.10f   %.4f   %d  12\n", 35 + tenths / 600,
                    0.1 * (tenths % 600), p.y(), p.x(), p.z() + kUndulation_m + kAntenna_m, i == 5 ? 2 : 1);
      text += line;
    }
    return text;
  }
  TruthOptions options() const {
    return {.dem = folder_ / "dsm.tif", .dem_heights = HeightDatum::geoid, .geoid_undulation_m = kUndulation_m};
  }

  const fs::path folder_ =
      fs::path(testing::TempDir()) /
      (std::string("GeodeticTruth.") + testing::UnitTest::GetInstance()->current_test_info()->name());
  const fs::path truth_ = folder_ / "global_lle.pos";
  DemRaster dem_{.rows = 60, .cols = 60, .cell_m = 2.0, .west_m = -60.0, .north_m = 60.0};
  Trajectory drive_;
};

TEST_F(GeodeticTruth, IsComparedInTheDemsMapAtTheGivenClock) {
  TruthOptions given = options();
  given.clock_offset_s = kClock_s;
  const Evaluation e = evaluate_run(folder_ / "run.tum", truth_, {}, given);
  EXPECT_EQ(e.poses, 59U) << "one fix is of quality 2";
  EXPECT_NEAR(e.ate_horizontal.rmse, 0.0, 1e-3);
  EXPECT_NEAR(e.ate_vertical.rmse, kAntenna_m, 1e-3);
  EXPECT_FALSE(e.rpe_rotation_deg);
  EXPECT_THAT(e.notes, Contains(HasSubstr("59 of 60 fixes")));
  EXPECT_THAT(e.notes, Contains(HasSubstr("43.46 m above the ellipsoid")));
  EXPECT_THAT(e.notes, Contains(HasSubstr("lies 1.50 m above the DEM")));
  EXPECT_THAT(e.notes, Contains(HasSubstr("RPE rotation is refused")));
}

TEST_F(GeodeticTruth, TheClocksDifferenceIsEstimated) {
  TruthOptions estimated = options();
  estimated.estimate_clock_offset = true;
  const Evaluation e =
      evaluate_run(folder_ / "run.tum", truth_, {.association = {.max_difference_s = 0.05}}, estimated);
  EXPECT_NEAR(e.clock_offset_s, kClock_s, 0.01);
  EXPECT_NEAR(e.ate_se3->rmse, 0.0, 0.05);
  EXPECT_THAT(e.notes, Contains(HasSubstr("clock: 16.7")));
  EXPECT_THAT([&] { evaluate_run(folder_ / "run.tum", truth_, {}, options()); },
              ThrowsMessage<Error>(HasSubstr("give a time offset")))
      << "16.7 s later, nothing pairs within 0.01 s";
}

TEST_F(GeodeticTruth, NeedsADemThatSaysWhatItsHeightsCountFrom) {
  EXPECT_THAT([&] { read_truth(truth_, TruthOptions{}); }, ThrowsMessage<Error>(HasSubstr("pass --dem FILE")));
  EXPECT_THAT([&] { read_truth(truth_, {.dem = folder_ / "dsm.tif"}); },
              ThrowsMessage<Error>(HasSubstr("does not say what its heights count from")));
  EXPECT_THAT([&] { read_truth(truth_, {.dem = folder_ / "dsm.tif", .dem_heights = HeightDatum::geoid}); },
              ThrowsMessage<Error>(HasSubstr("pass --geoid-undulation-m")));
  dem_.frame = with_heights(dem_.frame, HeightDatum::geoid, kUndulation_m);
  write_dem(folder_ / "ellipsoidal.tif", dem_);
  const Truth truth = read_truth(truth_, {.dem = folder_ / "ellipsoidal.tif"});
  EXPECT_NEAR(truth.file.poses.front().pose.translation().z(), kAntenna_m, 1e-3);
  EXPECT_THAT([&] { read_truth(truth_, {.dem = folder_ / "ellipsoidal.tif", .geoid_undulation_m = kUndulation_m}); },
              ThrowsMessage<Error>(HasSubstr("not from a geoid")));
}

TEST_F(GeodeticTruth, OfAnotherBodyThanTheDemsIsRefused) {
  dem_.frame = {crs_wkt_of("IAU_2015:30135"), {0.0, 0.0, 0.0}, HeightDatum::sphere};
  write_dem(folder_ / "moon.tif", dem_);
  EXPECT_THAT([&] { read_truth(truth_, {.dem = folder_ / "moon.tif"}); },
              ThrowsMessage<Error>(HasSubstr("satellite navigation is on Earth (WGS84)")));
}

TEST_F(GeodeticTruth, ACsvOfLongitudesAndLatitudesIsOnTheDemsOwnBody) {
  dem_.frame = {crs_wkt_of("IAU_2015:30135"), {1000.0, 2000.0, -300.0}, HeightDatum::sphere};
  write_dem(folder_ / "moon.tif", dem_);
  std::ofstream csv(folder_ / "truth.csv");
  csv << "time_s,Latitude [deg],Longitude [deg],Height [m],fix\n";
  csv.precision(14);
  for (const StampedPose& stamped : drive_) {
    const Eigen::Vector3d p = lon_lat_height(stamped);
    csv << stamped.t_ns / 1'000'000'000 << ".0," << p.y() << "," << p.x() << "," << p.z() << ",1\n";
  }
  csv.close();
  const Evaluation e = evaluate_run(folder_ / "run.tum", folder_ / "truth.csv", {}, {.dem = folder_ / "moon.tif"});
  EXPECT_EQ(e.poses, 60U);
  EXPECT_NEAR(e.ate.rmse, 0.0, 1e-3);
}

TEST_F(GeodeticTruth, BrokenCsvFilesAreRefusedWithTheirLine) {
  const auto reading = [&](const std::string& text) {
    return [this, text] {
      std::ofstream(folder_ / "bad.csv") << text;
      read_geodetic(folder_ / "bad.csv");
    };
  };
  EXPECT_THAT(reading("t_ns,lon,lat\n1,2,3\n"), ThrowsMessage<Error>(HasSubstr(":1: the header must name")));
  EXPECT_THAT(reading("t_ns,lon,lat,height\n1,2\n"), ThrowsMessage<Error>(HasSubstr(":2:")));
  EXPECT_THAT(reading("t_ns,lon,lat,height\n1,500000,4177000,2400\n"),
              ThrowsMessage<Error>(HasSubstr("must be degrees")));
  EXPECT_THAT(reading("t_ns,lon,lat,height\n2,15,37,1\n1,15,37,1\n"),
              ThrowsMessage<Error>(HasSubstr(":3: the times must increase")));
  EXPECT_THAT(reading("t_ns,lon,lat,height\n1,15,nan,1\n"), ThrowsMessage<Error>(HasSubstr("'nan'")));
  EXPECT_THAT(reading("t_ns,lon,lat,height\n"), ThrowsMessage<Error>(HasSubstr("there is no position")));
}

TEST_F(GeodeticTruth, ExportsEveryFormatAndTheErrorOnTheDemsGrid) {
  Trajectory late = drive_;
  for (StampedPose& stamped : late) {
    stamped.pose = Pose(stamped.pose.rotation(), stamped.pose.translation() + Eigen::Vector3d(3.0, 4.0, 0.0));
  }
  std::ofstream(folder_ / "truth.tum") << tum_text(drive_);
  std::ofstream(folder_ / "late.tum") << tum_text(late);
  const auto files = export_run({.run_or_trajectory = folder_ / "late.tum",
                                 .truth = folder_ / "truth.tum",
                                 .output = folder_ / "out",
                                 .options = {.dem = folder_ / "dsm.tif"}});
  std::set<std::string> names;
  for (const fs::path& file : files) names.insert(file.filename().string());
  EXPECT_THAT(names, testing::UnorderedElementsAre("trajectory.tum", "trajectory_kitti.txt", "times.txt",
                                                   "trajectory_euroc.csv", "trajectory.geojson", "trajectory.kml",
                                                   "truth.tum", "error.tif", "truth.geojson", "truth.kml"));
  for (const char* name : {"trajectory.tum", "trajectory_kitti.txt", "trajectory_euroc.csv"}) {
    const TrajectoryFile back = read_trajectory(folder_ / "out" / name);
    ASSERT_EQ(back.poses.size(), late.size()) << name;
    EXPECT_EQ(back.poses[7].t_ns, late[7].t_ns) << name;
    EXPECT_TRUE(back.poses[7].pose.matrix().isApprox(late[7].pose.matrix(), 1e-9)) << name;
  }
  const DemRaster error = read_dem(folder_ / "out/error.tif", dem_.frame.origin + Eigen::Vector3d(0, 0, -2400.0));
  EXPECT_EQ(error.rows, dem_.rows);
  std::size_t cells = 0;
  for (const float value : error.heights) {
    if (!std::isfinite(value)) continue;
    EXPECT_NEAR(value, 5.0F, 1e-4F);
    ++cells;
  }
  EXPECT_GT(cells, 30U);
  EXPECT_LE(cells, late.size());
}

}  // namespace
}  // namespace demslam
