#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "demslam/base/error.h"
#include "demslam/report/live_report.h"
#include "demslam/report/report_page.h"
#include "demslam/report/residuals.h"
#include "demslam/report/run_snapshot.h"
#include "demslam/report/test_run.h"

namespace demslam {
namespace {

using nlohmann::json;
using testing::Each;
using testing::FloatNear;
using testing::HasSubstr;
using testing::SizeIs;

std::string bytes_of(const std::string& base64) {
  std::string bytes;
  unsigned int word = 0;
  int bits = 0;
  for (const char c : base64) {
    const auto digit = std::string("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/").find(c);
    if (digit == std::string::npos) break;
    word = word << 6 | static_cast<unsigned int>(digit);
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes += static_cast<char>(word >> bits & 0xffU);
  }
  return bytes;
}

template <class T>
std::vector<T> numbers(const json& packed, const char* type) {
  const std::string bytes = bytes_of(packed.at(type).get<std::string>());
  std::vector<T> values(bytes.size() / sizeof(T));
  std::copy(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(values.size() * sizeof(T)),
            reinterpret_cast<char*>(values.data()));
  return values;
}

std::vector<float> floats(const json& packed) { return numbers<float>(packed, "f32"); }

Report report_of(const test::SmallRun& run) { return read_report({run.run()}, std::nullopt, std::nullopt); }

json data_of(const test::SmallRun& run, const PageOptions& options = {}) {
  return json::parse(page_data(report_of(run), options));
}

TEST(PageData, HoldsEveryFrameAndKeyframeOfAShortRun) {
  const test::SmallRun run(41);
  const json page = data_of(run);
  ASSERT_THAT(page["runs"], SizeIs(1));
  const json& shown = page["runs"][0];
  EXPECT_EQ(shown["name"], "run");
  EXPECT_THAT(floats(shown["track"]["x_m"]), SizeIs(41));
  EXPECT_THAT(floats(shown["keyframes"]["x_m"]), SizeIs(11));
  EXPECT_THAT(floats(shown["frames"]["inliers"]), SizeIs(41));
  EXPECT_THAT(floats(shown["frames"]["inliers"]), Each(90.0F));
  EXPECT_FLOAT_EQ(floats(shown["keyframes"]["x_m"])[10], 20.0F);
  EXPECT_FLOAT_EQ(floats(shown["keyframes"]["distance_m"])[10], 20.0F);
  EXPECT_FLOAT_EQ(floats(shown["keyframes"]["time_s"])[10], 40.0F);
  EXPECT_EQ(shown["summary"]["frames_asked"], 41);
}

TEST(PageData, EveryNumberOverFramesCarriesItsUnitInItsName) {
  const test::SmallRun run(9);
  const json shown = data_of(run)["runs"][0];
  for (const char* name : {"distance_m", "keypoints", "matches", "inliers", "rms_px", "extract_ms", "total_ms"})
    EXPECT_TRUE(shown["frames"].contains(name)) << name;
  for (const char* name : {"cov_xx_m2", "cov_xy_m2", "cov_yy_m2", "cov_zz_m2", "heading_rad"})
    EXPECT_TRUE(shown["keyframes"].contains(name)) << name;
}

TEST(PageData, ErrorsAreThoseOfTheEvaluation) {
  const test::SmallRun run(41);
  const json shown = data_of(run)["runs"][0];
  EXPECT_THAT(floats(shown["errors"]["horizontal_m"]), Each(FloatNear(0.1F, 1e-5F)));
  EXPECT_THAT(floats(shown["errors"]["vertical_m"]), Each(FloatNear(0.2F, 1e-5F)));
  EXPECT_NEAR(shown["evaluation"]["ate_rmse_m"].get<double>(), std::hypot(0.1, 0.2), 1e-9);
  EXPECT_EQ(shown["distance_along"], "truth");
}

TEST(PageData, ReadsLusnarsTruthInItsOwnAxesAsTheEvaluationDoes) {
  const test::SmallRun run(41);
  std::filesystem::rename(run.dataset() / "gt.txt", run.dataset() / "Rover_pose.txt");
  const json page = data_of(run);
  const Trajectory truth = read_truth(run.dataset() / "Rover_pose.txt").poses;
  EXPECT_FLOAT_EQ(floats(page["truth"]["z_m"]).back(), static_cast<float>(truth.back().pose.translation().z()));
  EXPECT_EQ(page["runs"][0]["distance_along"], "truth");
}

TEST(PageData, ATruthThatCannotBeUsedIsARemarkUnlessItWasAskedFor) {
  const test::SmallRun run(9);
  std::ofstream(run.dataset() / "gt.txt") << "nonsense\n";
  const json page = data_of(run);
  EXPECT_TRUE(page["runs"][0]["evaluation"].is_null());
  EXPECT_THAT(page["notes"].dump(), HasSubstr("run: no errors are shown"));
  EXPECT_THROW(read_report({run.run()}, run.dataset() / "gt.txt", std::nullopt), Error);
}

TEST(PageData, TerrainHasTheDemsHeights) {
  const test::SmallRun run(41);
  const json terrain = data_of(run)["terrain"];
  EXPECT_EQ(terrain["file"], "dem.tif");
  EXPECT_FLOAT_EQ(terrain["low_m"].get<float>(), 0.0F);
  EXPECT_THAT(numbers<std::uint16_t>(terrain["heights"], "u16"),
              SizeIs(terrain["rows"].get<int>() * terrain["cols"].get<int>()));
}

TEST(PageData, ShowsTheImagesThatCanBeReadWithTheirFeatures) {
  const test::SmallRun run(41);
  run.write_map();
  const json page = data_of(run);
  const json& views = page["runs"][0]["views"];
  ASSERT_THAT(views, SizeIs(2));  // the dataset holds the first and the last image
  EXPECT_EQ(views[1]["keyframe"], 10);
  EXPECT_EQ(views[1]["matched_with"], 9);
  EXPECT_THAT(numbers<std::uint16_t>(views[1]["features"], "u16"), SizeIs(3 * 20));
  EXPECT_EQ(page["images"][1]["width_px"], 640);
  EXPECT_EQ(bytes_of(page["images"][1]["jpeg"]).substr(0, 3), "\xff\xd8\xff");
}

TEST(PageData, ResidualsOfTheMapsFactorsAreMeasuredAgainstTheFinalPoses) {
  const test::SmallRun run(41);
  run.write_map();
  const json odometry = data_of(run)["runs"][0]["residuals"]["odometry"];
  EXPECT_THAT(floats(odometry["translation_m"]), testing::AllOf(SizeIs(10), Each(FloatNear(0.01F, 1e-6F))));
  EXPECT_THAT(floats(odometry["chi_square"]), Each(FloatNear(1.0F, 1e-4F)));  // 0.01^2 / 1e-4
}

TEST(PageData, ResidualsOfTheOtherFactorsAreInStandardDeviationsPerRow) {
  const test::SmallRun run(41);
  const json residuals = data_of(run)["runs"][0]["residuals"];
  EXPECT_THAT(floats(residuals["dem_height"]["sigmas"]), testing::ElementsAre(2.0F));
  EXPECT_THAT(floats(residuals["terrain_patch"]["sigmas"]), testing::ElementsAre(2.0F));
  EXPECT_THAT(floats(residuals["terrain_patch"]["distance_m"]), testing::ElementsAre(4.0F));
}

TEST(PageData, WithoutAMapTheOdometryIsMeasuredBetweenTheTrajectories) {
  const test::SmallRun run(41);
  const json page = data_of(run);
  const json odometry = page["runs"][0]["residuals"]["odometry"];
  EXPECT_THAT(floats(odometry["translation_m"]), testing::AllOf(SizeIs(10), Each(FloatNear(0.0F, 1e-6F))));
  EXPECT_THAT(page["notes"].dump(), HasSubstr("no map.db"));
}

TEST(PageData, IsWholeWithoutTruthDemAndDataset) {
  const test::SmallRun run(9);
  std::filesystem::remove_all(run.dataset());
  Report report = report_of(run);
  report.dem.reset();
  const json page = json::parse(page_data(report));
  EXPECT_TRUE(page["terrain"].is_null());
  EXPECT_TRUE(page["truth"].is_null());
  EXPECT_TRUE(page["runs"][0]["evaluation"].is_null());
  EXPECT_FALSE(page["runs"][0].contains("views"));
  EXPECT_EQ(page["runs"][0]["distance_along"], "own track");
  EXPECT_FLOAT_EQ(floats(page["runs"][0]["keyframes"]["distance_m"])[2], 4.0F);
  EXPECT_THAT(page["notes"], SizeIs(4));
}

TEST(PageData, KeepsItsSizeHoweverManyFramesThereAre) {
  const test::SmallRun run(22000);  // 11 km
  const std::string data = page_data(report_of(run));
  EXPECT_LT(data.size(), 4'000'000U);  // without images
  const json frames = json::parse(data)["runs"][0]["frames"];
  const std::vector<float> time = floats(frames["total_ms"]);
  EXPECT_EQ(*std::max_element(time.begin(), time.end()), 900.0F);  // one frame of 22000
}

TEST(PageData, CannotEndTheScriptItStandsIn) {
  const test::SmallRun run(5);
  const std::string data = page_data(report_of(run));
  EXPECT_EQ(data.find('<'), std::string::npos);
  EXPECT_THAT(json::parse(data)["runs"][0]["config"].get<std::string>(), HasSubstr("</script>"));
}

TEST(PageData, TheSameRunGivesTheSameBytes) {
  const test::SmallRun run(41);
  run.write_map();
  EXPECT_EQ(page_data(report_of(run)), page_data(report_of(run)));
}

TEST(ReportFolder, LeavesOutALineThatIsNotFinished) {
  const test::SmallRun run(9);
  std::ofstream(run.run() / "frames.jsonl", std::ios::app) << R"({"frame":9,"t_)";
  EXPECT_THAT(read_frame_lines(run.run()), SizeIs(9));
}

TEST(ReportFolder, NamesTheLineThatIsNoRecord) {
  const test::SmallRun run(9);
  std::ofstream(run.run() / "frames.jsonl", std::ios::app) << "nonsense\n";
  EXPECT_THAT([&] { read_frame_lines(run.run()); }, testing::ThrowsMessage<Error>(HasSubstr("frames.jsonl:10: ")));
}

TEST(RunSnapshot, IsARunFolderOfWhatTheMapHolds) {
  const test::SmallRun run(41);
  run.write_map();
  std::filesystem::path folder;
  {
    const RunSnapshot snapshot(run.run());
    folder = snapshot.path();
    EXPECT_EQ(folder.filename(), "run");
    const Report report = read_report({folder}, std::nullopt, std::nullopt);
    EXPECT_THAT(report.runs[0].trajectory, SizeIs(11));
    EXPECT_NEAR(report.runs[0].trajectory.back().pose.translation().x(), 20.0, 1e-9);
    EXPECT_TRUE(json::parse(report.runs[0].summary)["running"]);
  }
  EXPECT_FALSE(std::filesystem::exists(folder));
  EXPECT_TRUE(std::filesystem::exists(run.run() / "map.db"));
}

TEST(RunSnapshot, OfARunThatHasPlacedNothingIsAnError) {
  const test::SmallRun run(9);
  EXPECT_THAT([&] { RunSnapshot{run.run()}; }, testing::ThrowsMessage<Error>(HasSubstr("no map yet")));
}

TEST(LiveReport, HasAPageBeforeTheRunHasPlacedAnything) {
  LiveReport report("/nowhere");
  const json page = json::parse(*report.state().data);
  EXPECT_EQ(page["live"], "events");
  EXPECT_FALSE(page.contains("runs"));
}

TEST(LiveReport, MakesANewStateOnlyWhenTheRunHasGrown) {
  const test::SmallRun run(41);
  run.write_map();
  LiveReport report(run.run());
  const LiveState first = report.state(), again = report.state();
  EXPECT_EQ(json::parse(*first.data)["runs"][0]["name"], "run");
  EXPECT_EQ(again.number, first.number);
  EXPECT_EQ(report.last_state().number, first.number + 1);
}

TEST(TerrainResidual, IsHeightAboveTheDemAndTheAngleToItsNormal) {
  DemRaster raster{.rows = 20, .cols = 20, .cell_m = 1.0, .west_m = -10.0, .north_m = 10.0};
  for (int row = 0; row < 20; ++row) {
    for (int col = 0; col < 20; ++col) raster.heights.push_back(static_cast<float>(raster.centre(row, col).x()));
  }
  const Dem slope(raster);  // 45 degrees
  const TerrainResidual r = residual_of(slope, Pose(Eigen::Quaterniond::Identity(), {1.0, 0.0, 3.5}), {0.0, 0.0, -0.5});
  EXPECT_NEAR(r.height_m, 2.0, 1e-6);
  EXPECT_NEAR(r.normal_deg, 45.0, 1e-4);
  EXPECT_TRUE(std::isnan(residual_of(slope, Pose(Eigen::Quaterniond::Identity(), {99.0, 0.0, 0.0}), {}).height_m));
}

}  // namespace
}  // namespace demslam
