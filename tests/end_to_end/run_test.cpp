// The whole line on a short simulated traverse: files, determinism, blindness to the truth, interruption.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "program.h"

namespace demslam {
namespace {

using namespace testing_support;
using testing::HasSubstr;

/// Everything a run writes but its wall-clock times.
const std::vector<std::string> kResults = {"trajectory.tum", "odometry.tum", "covariance.csv", "residuals.csv",
                                           "frames.jsonl",   "config.toml",  "summary.json"};

class Run : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) /
              ("run_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    dataset_ = folder_ / "data";
    fs::copy(DEMSLAM_TINY_DATASET, dataset_, fs::copy_options::recursive);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path run(const std::string& name, const std::string& more = "", const std::string& prefix = "") {
    const fs::path output = folder_ / name;
    last_ = run_program("run '" + dataset_.string() + "' -o '" + output.string() + "' " + more, folder_, prefix);
    return output;
  }
  nlohmann::json evaluate(const fs::path& run_folder, const std::string& more = "") {
    const fs::path json = folder_ / "evaluation.json";
    last_ = run_program("evaluate '" + run_folder.string() + "' --json '" + json.string() + "' " + more, folder_);
    EXPECT_EQ(last_.status, 0) << last_.err;
    const auto parsed = nlohmann::json::parse(read_text(json));
    return parsed.is_array() ? parsed.at(0) : parsed;
  }

  fs::path folder_, dataset_;
  Outcome last_;
};

TEST_F(Run, TracksEveryFrameAndWritesTheWholeFolder) {
  const fs::path output = run("run");
  ASSERT_EQ(last_.status, 0) << last_.err;
  for (const std::string& name : kResults) EXPECT_GT(fs::file_size(output / name), 0U) << name;
  const auto summary = nlohmann::json::parse(read_text(output / "summary.json"));
  EXPECT_EQ(summary["counters"]["tracked"], summary["frames_in_dataset"]);
  EXPECT_TRUE(summary["anchored"]);
  EXPECT_GT(summary["counters"]["dem_factors"]["height"], 0);
}

TEST_F(Run, EveryDemFactorHasItsResidual) {
  const fs::path output = run("run");
  const auto counters = nlohmann::json::parse(read_text(output / "summary.json"))["counters"]["dem_factors"];
  const std::string residuals = read_text(output / "residuals.csv");
  std::map<std::string, int> count;
  std::istringstream lines(residuals);
  for (std::string line; std::getline(lines, line);) ++count[line.substr(0, line.find(','))];
  EXPECT_EQ(count["dem_height"], counters["height"]) << residuals;
  EXPECT_EQ(count["dem_normal"], counters["normal"]) << residuals;
  EXPECT_EQ(count["prior"], 1) << residuals;
}

TEST_F(Run, EvaluationFindsTheTruthAndTheErrorIsSmall) {
  const auto evaluation = evaluate(run("run", "--odometry-only"));
  EXPECT_EQ(evaluation["completion"], 1.0);
  EXPECT_NEAR(evaluation["path_length_m"], 12.0, 1.0);
  EXPECT_LT(evaluation["ate_se3_rmse_m"], 0.2);
  EXPECT_GT(evaluation["ate_se3_rmse_m"], 0.0);
}

TEST_F(Run, GivesTheSameBytesTwice) {
  const fs::path first = run("first"), second = run("second");
  for (const std::string& name : kResults) EXPECT_EQ(read_text(first / name), read_text(second / name)) << name;
}

TEST_F(Run, RendersTheImagesThatTheDatasetLacks) {
  const fs::path files = run("files", "--max-frames 8");
  fs::remove_all(dataset_ / "image0");
  fs::remove_all(dataset_ / "image1");
  const fs::path rendered = run("rendered", "--max-frames 8");
  ASSERT_EQ(last_.status, 0) << last_.err;
  for (const std::string name : {"trajectory.tum", "frames.jsonl"}) {
    EXPECT_EQ(read_text(files / name), read_text(rendered / name)) << name;
  }
}

TEST_F(Run, NeverSeesTheTruth) {
  const fs::path clean = run("clean");
  std::string poisoned;
  std::istringstream lines(read_text(dataset_ / "gt.txt"));
  for (std::string line; std::getline(lines, line);) {
    const auto first = line.find(','), second = line.find(',', first + 1);
    if (!line.empty() && line[0] != '#') {
      const double x = std::stod(line.substr(first + 1, second - first - 1));
      line = line.substr(0, first + 1) + std::to_string(x + 1e6) + line.substr(second);
    }
    poisoned += line + "\n";
  }
  ASSERT_NE(poisoned, read_text(dataset_ / "gt.txt"));
  write_text(dataset_ / "gt.txt", poisoned);
  fs::remove_all(dataset_ / "truth");
  const fs::path blind = run("blind");
  for (const std::string& name : kResults) EXPECT_EQ(read_text(clean / name), read_text(blind / name)) << name;
  EXPECT_GT(evaluate(blind)["ate_rmse_m"], 1e5);  // the poison did arrive where truth is read
}

TEST_F(Run, OdometryOnlyIgnoresTheDem) {
  const fs::path plain = run("plain", "--odometry-only");
  fs::remove(dataset_ / "dem.tif");
  const fs::path without = run("without", "--no-dem --no-loops");
  EXPECT_EQ(read_text(plain / "odometry.tum"), read_text(without / "odometry.tum"));
}

TEST_F(Run, CtrlCLeavesAValidRunFolder) {
  const fs::path stop = folder_ / "stop.sh";  // at the first frame, however slow the machine is today
  write_text(stop,
             "\"$@\" & p=$!\n"
             "while kill -0 $p 2>/dev/null && ! [ -s '" +
                 (folder_ / "stopped/frames.jsonl").string() +
                 "' ]; do sleep 0.01; done\n"
                 "kill -INT $p; wait $p\n");
  const fs::path output = run("stopped", "", "sh '" + stop.string() + "'");
  if (last_.status == 0) GTEST_SKIP() << "the run ended before the interrupt";
  EXPECT_EQ(last_.status, 130);
  const auto summary = nlohmann::json::parse(read_text(output / "summary.json"));
  EXPECT_TRUE(summary["interrupted"]);
  const std::string frames = read_text(output / "frames.jsonl");
  EXPECT_EQ(std::count(frames.begin(), frames.end(), '\n'), summary["counters"]["frames"].get<long>());
  EXPECT_THAT(read_text(output / "trajectory.tum"), HasSubstr("\n"));
}

TEST_F(Run, TheEffectiveConfigurationReproducesTheRun) {
  const fs::path first = run("first", "--no-loops"),
                 again = run("again", "-c '" + (first / "config.toml").string() + "'");
  EXPECT_EQ(read_text(first / "trajectory.tum"), read_text(again / "trajectory.tum"));
}

}  // namespace
}  // namespace demslam
