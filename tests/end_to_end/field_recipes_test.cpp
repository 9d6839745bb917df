// The recipes of docs/datasets.md, end to end: LuSNAR (LiDAR to DEM to anchored run) and S3LI (bag, satellite truth,
// DSM in UTM above a geoid), on a simulated traverse written to their layouts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "demslam/dem/local_frame.h"
#include "field_data.h"
#include "program.h"

namespace demslam {
namespace {

using namespace testing_support;
using testing::HasSubstr;
using Json = nlohmann::json;

class Recipe : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) /
              ("recipe_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string at(const std::string& name) const { return "'" + (folder_ / name).string() + "'"; }
  /// Runs a command that must succeed, and gives what it wrote with --json (which must be its last word) or printed.
  Outcome run(const std::string& arguments) const {
    const Outcome outcome = run_program(arguments, folder_);
    EXPECT_EQ(outcome.status, 0) << arguments << "\n" << outcome.err;
    return outcome;
  }
  Json json_of(const std::string& arguments) const {
    run(arguments + " --json " + at("out.json"));
    return Json::parse(read_text(folder_ / "out.json"));
  }
  Json summary() const { return Json::parse(read_text(folder_ / "run" / "summary.json")); }

  const fs::path simulated_ = DEMSLAM_FIELD_DATASET;
  const std::string calibration_ = " --calibration '" + (simulated_ / "calibration.toml").string() + "'";
  fs::path folder_;
};

TEST_F(Recipe, LusnarFromLidarToDemToAnchoredRun) {
  write_lusnar(simulated_, folder_ / "Moon_1");
  EXPECT_EQ(json_of("dataset info " + at("Moon_1") + calibration_)["format"], "lusnar");

  const Json built = json_of("dem build " + at("Moon_1") + " --from lidar --poses " + at("Moon_1/LiDAR/timestamp.txt") +
                             " --cell-m 2 -o " + at("dem.tif"));
  EXPECT_TRUE(built["world_z_down"]);
  EXPECT_EQ(built["scans_without_pose"], 0);
  EXPECT_GT(built["points"], 100000);
  const Json difference = json_of("dem compare " + at("dem.tif") + " '" +
                                  (simulated_ / "truth/dem_truth.tif").string() + "' -o " + at("difference.tif"));
  EXPECT_LT(std::abs(difference["median_m"].get<double>()), 0.1);
  EXPECT_LT(difference["nmad_m"], 0.3);

  run("dataset start " + at("Moon_1") + calibration_ + " --poses " + at("Moon_1/gt.txt") + " -o " + at("start.toml"));
  run("run " + at("Moon_1") + calibration_ + " --dem " + at("dem.tif") + " --start " + at("start.toml") + " -o " +
      at("run"));
  EXPECT_GT(summary()["counters"]["dem_factors"]["height"], 0);
  EXPECT_THAT(summary()["inputs"]["dem_sigma"]["path"].get<std::string>(), HasSubstr("dem_sigma.tif"));
  const Json evaluation = json_of("evaluate " + at("run"));
  EXPECT_EQ(evaluation["completion"], 1.0);
  EXPECT_LT(evaluation["ate_rmse_m"], 0.5);
  EXPECT_LT(evaluation["ate_vertical_rmse_m"], 0.2);
}

TEST_F(Recipe, LusnarDepthImagesMakeTheSameDem) {
  write_lusnar(simulated_, folder_ / "Moon_1");
  const std::string dataset = at("Moon_1");
  run("dem build " + dataset + calibration_ + " --from depth --poses " + at("Moon_1/gt.txt") +
      " --max-range-m 12 --pixel-step 2 --cell-m 2 -o " + at("depth.tif"));
  run("dem build " + dataset + " --from lidar --poses " + at("Moon_1/LiDAR/timestamp.txt") +
      " --max-range-m 12 --cell-m 2 -o " + at("lidar.tif"));
  const Json difference = json_of("dem compare " + at("depth.tif") + " " + at("lidar.tif"));
  EXPECT_LT(std::abs(difference["median_m"].get<double>()), 0.05);
  EXPECT_LT(difference["nmad_m"], 0.2);
}

TEST_F(Recipe, S3liFromBagAndFixesAndAGeoidDsmToAnchoredRun) {
  write_etna(simulated_, folder_, {.compression = Compression::bz2});
  const Json info = json_of("dataset info " + at("crater.bag"));
  EXPECT_EQ(info["format"], "s3li");
  EXPECT_EQ(info["unpaired"], 2);

  const Eigen::Vector3d centre = Georeference(LocalFrame{crs_wkt_of("EPSG:32633"), {501208.0, 4177003.0, 0.0}})
                                     .lon_lat_height(Eigen::Vector3d::Zero());
  run("dem crop " + at("dsm.tif") + " --center " + std::to_string(centre.x()) + " " + std::to_string(centre.y()) +
      " --radius-m 50 --cell-m 2 --heights geoid --geoid-undulation-m 43.46 -o " + at("dem.tif"));
  EXPECT_EQ(json_of("dem info " + at("dem.tif"))["heights_from"], "ellipsoid");
  const std::string fixes = at("global_lle.pos");
  run("dataset start " + at("crater.bag") + calibration_ + " --poses " + fixes + " --dem " + at("dem.tif") +
      " --clock-offset-s 16.7 -o " + at("start.toml"));
  run("run " + at("crater.bag") + calibration_ + " --dem " + at("dem.tif") + " --start " + at("start.toml") + " -o " +
      at("run"));
  EXPECT_GT(summary()["counters"]["dem_factors"]["height"], 0);

  const Json evaluation =
      json_of("evaluate " + at("run") + " --truth " + fixes + " --clock-offset-s 16.7 --max-difference-s 0.11");
  EXPECT_GT(evaluation["poses"], 20);
  EXPECT_LT(evaluation["ate_horizontal_rmse_m"], 1.0);
  EXPECT_LT(evaluation["ate_vertical_rmse_m"], 0.3) << "a forgotten geoid would be 43 m";
  EXPECT_TRUE(evaluation["rpe_rotation_rmse_deg"].is_null());
  EXPECT_THAT(evaluation["notes"].dump(), HasSubstr("RPE rotation is refused: the truth has positions only"));
  const Json clock =
      json_of("evaluate " + at("run") + " --truth " + fixes + " --clock-offset-s auto --max-difference-s 0.11");
  EXPECT_NEAR(clock["clock_offset_s"], 16.7, 1.0);

  run("export " + at("run") + " --truth " + fixes + " --clock-offset-s 16.7 --max-difference-s 0.11 -o " + at("out"));
  for (const char* name : {"trajectory.tum", "trajectory_kitti.txt", "trajectory_euroc.csv", "trajectory.geojson",
                           "trajectory.kml", "truth.geojson", "error.tif"}) {
    EXPECT_GT(fs::file_size(folder_ / "out" / name), 0U) << name;
  }
}

TEST_F(Recipe, BagsOfEveryCompressionAreTheSameDataset) {
  std::vector<std::string> seen;
  for (const Compression compression : {Compression::none, Compression::bz2, Compression::lz4}) {
    const std::string name = name_of(compression);
    write_etna(simulated_, folder_ / name, {.compression = compression});
    Json info = json_of("dataset info " + at(name + "/crater.bag"));
    info.erase("dataset");
    const Json check = json_of("dataset check --frames 2 " + at(name + "/crater.bag"));
    EXPECT_NEAR(check["row_offset_px"], 0.0, 0.3) << name;
    seen.push_back(info.dump() + check["row_offset_px"].dump() + check["row_patches"].dump());
  }
  EXPECT_EQ(seen[0], seen[1]);
  EXPECT_EQ(seen[0], seen[2]);
}

}  // namespace
}  // namespace demslam
