// Real stereo images from the folder of reference data; skipped where it is missing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "program.h"

namespace demslam {
namespace {

using namespace testing_support;

class RealData : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) /
              ("real_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  nlohmann::json run(const fs::path& dataset, const std::string& more = "") {
    const Outcome outcome =
        run_program("run '" + dataset.string() + "' -o '" + (folder_ / "run").string() + "' " + more, folder_);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return nlohmann::json::parse(read_text(folder_ / "run" / "summary.json"));
  }
  nlohmann::json evaluate(const std::string& more) {
    const fs::path json = folder_ / "evaluation.json";
    const Outcome outcome =
        run_program("evaluate '" + (folder_ / "run").string() + "' --json '" + json.string() + "' " + more, folder_);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    const auto parsed = nlohmann::json::parse(read_text(json));
    return parsed.is_array() ? parsed.at(0) : parsed;
  }

  fs::path folder_, data_ = fs::path(DEMSLAM_SHARED_DIR) / "data";
};

TEST_F(RealData, KittiIsTrackedWhollyWithinOnePercent) {
  if (!fs::exists(data_ / "kitti_seq1")) GTEST_SKIP() << "reference data missing: kitti_seq1";
  const auto summary = run(data_ / "kitti_seq1");
  EXPECT_EQ(summary["counters"]["tracked"], 51);
  EXPECT_LT(evaluate("")["drift_percent"], 1.0);
}

TEST_F(RealData, EurocIsTrackedWhollyWithinFiveCentimetres) {
  if (!fs::exists(data_ / "euroc_v101_short")) GTEST_SKIP() << "reference data missing: euroc_v101_short";
  const auto summary = run(data_ / "euroc_v101_short");
  EXPECT_EQ(summary["counters"]["tracked"], summary["frames_in_dataset"]);
  EXPECT_LT(evaluate("")["ate_se3_rmse_m"], 0.05);
}

TEST_F(RealData, TheRoverSandboxIsTrackedWhollyOverItsTwelveMetres) {
  if (!fs::exists(data_ / "rover_sandbox")) GTEST_SKIP() << "reference data missing: rover_sandbox";
  const auto summary =
      run(data_ / "rover_sandbox", "--calibration '" DEMSLAM_SOURCE_DIR "/configs/rover_sandbox.toml'");
  EXPECT_EQ(summary["counters"]["tracked"], 451);
  EXPECT_NEAR(summary["path_length_m"], 12.1, 1.0);
}

}  // namespace
}  // namespace demslam
