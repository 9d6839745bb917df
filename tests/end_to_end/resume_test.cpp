// A run that was stopped goes on, and ends as if nothing had happened.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "program.h"

namespace demslam {
namespace {

using namespace testing_support;
using testing::HasSubstr;

const std::vector<std::string> kResults = {"trajectory.tum", "odometry.tum", "covariance.csv", "residuals.csv",
                                           "frames.jsonl",   "config.toml",  "summary.json"};

class Resume : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) /
              ("resume_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string arguments(const std::string& name, const std::string& more) const {
    return "run '" DEMSLAM_TINY_DATASET "' -o '" + (folder_ / name).string() + "' " + more;
  }
  Outcome run(const std::string& name, const std::string& more = "", const std::string& prefix = "") {
    return run_program(arguments(name, more), folder_, prefix);
  }
  /// Starts a run and kills it (-9) as soon as it has written so many frames.
  void kill_after(const std::string& name, int frames, const std::string& more = "") {
    const fs::path records = folder_ / name / "frames.jsonl", script = folder_ / "kill.sh";
    write_text(script, "'" DEMSLAM_PROGRAM "' " + arguments(name, more) + " >/dev/null 2>&1 &\n" + "until [ $(cat '" +
                           records.string() + "' 2>/dev/null | wc -l) -ge " + std::to_string(frames) +
                           " ]; do sleep 0.02; done\nkill -9 $!\nwait\n");
    std::system(("bash '" + script.string() + "' 2>/dev/null").c_str());
    EXPECT_FALSE(fs::exists(folder_ / name / "summary.json"));
  }
  void expect_same(const std::string& a, const std::string& b) const {
    for (const std::string& name : kResults) {
      EXPECT_EQ(read_text(folder_ / a / name), read_text(folder_ / b / name)) << name;
    }
  }

  fs::path folder_;
};

TEST_F(Resume, AKilledRunEndsAsTheUndisturbedOne) {
  ASSERT_EQ(run("whole").status, 0);
  kill_after("killed", 8);
  kill_after("killed", 21);
  const Outcome outcome = run("killed");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("resumed at frame"));
  expect_same("whole", "killed");
  EXPECT_EQ(run_program("map check '" + (folder_ / "killed").string() + "'", folder_).status, 0);
}

TEST_F(Resume, WhatLooksAlikeIsTheSameBehindAKill) {
  const fs::path options = folder_ / "options.toml";
  write_text(options,
             "[odometry]\nkeyframe_max_distance_m = 0.5\n"
             "[loops]\nradius_m = 0.02\nmax_radius_m = 0.01\nmin_path_m = 1.0\nspacing_m = 0.0\n");  // always vague
  const std::string more = "-c '" + options.string() + "'";
  ASSERT_EQ(run("whole", more).status, 0);
  EXPECT_THAT(read_text(folder_ / "whole" / "summary.json"), testing::ContainsRegex("\"proposed\": [1-9]"));
  kill_after("killed", 25, more);
  const Outcome outcome = run("killed", more);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("resumed at frame"));
  expect_same("whole", "killed");
}

TEST_F(Resume, AKilledRunCanBeLookedAt) {
  kill_after("killed", 12);
  const fs::path page = folder_ / "killed.html";
  const Outcome outcome =
      run_program("report '" + (folder_ / "killed").string() + "' -o '" + page.string() + "'", folder_);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("has not ended"));
  EXPECT_NE(read_text(page).find("\"name\":\"killed\""), std::string::npos);
  EXPECT_FALSE(fs::exists(folder_ / "killed" / "summary.json"));  // only looked at
}

TEST_F(Resume, ARunCanBeMadeInPieces) {
  ASSERT_EQ(run("whole").status, 0);
  ASSERT_EQ(run("pieces", "--max-frames 11").status, 0);
  ASSERT_EQ(run("pieces").status, 0);
  expect_same("whole", "pieces");
}

TEST_F(Resume, AnotherOptionIsNamedAndNothingIsLost) {
  ASSERT_EQ(run("run", "--max-frames 5").status, 0);
  const std::string before = read_text(folder_ / "run" / "map.db");
  const Outcome outcome = run("run", "--no-loops");
  EXPECT_TRUE(outcome.is_one_line_error()) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("use_loops"));
  EXPECT_EQ(read_text(folder_ / "run" / "map.db"), before);
}

TEST_F(Resume, AnotherInputIsNamed) {
  ASSERT_EQ(run("run", "--max-frames 5").status, 0);
  const Outcome outcome = run("run", "--first-frame 2");
  EXPECT_TRUE(outcome.is_one_line_error()) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("first_frame"));
}

TEST_F(Resume, AnotherProcessorIsRefusedWhereItWouldRunTheNetworksOtherwise) {
  ASSERT_EQ(run("run", "--extractor lunar --max-frames 3").status, 0);
  if (read_text(folder_ / "run" / "summary.json").find("\"inference\": \"onednn bf16") == std::string::npos) {
    GTEST_SKIP() << "no native bfloat16 here";
  }
  EXPECT_THAT(read_text(folder_ / "run" / "config.toml"), HasSubstr("inference = 'onednn'"));
  const Outcome other = run("run", "--extractor lunar --max-frames 5", "ONEDNN_MAX_CPU_ISA=AVX2 ");
  EXPECT_TRUE(other.is_one_line_error()) << other.err;
  EXPECT_THAT(other.err, HasSubstr("input: inference"));
  EXPECT_EQ(run("run", "--extractor lunar --max-frames 5").status, 0);
}

TEST_F(Resume, OverwriteStartsAnew) {
  ASSERT_EQ(run("run", "--max-frames 5").status, 0);
  ASSERT_EQ(run("run", "--max-frames 4 --no-loops --overwrite").status, 0);
  const std::string frames = read_text(folder_ / "run" / "frames.jsonl");
  EXPECT_EQ(std::count(frames.begin(), frames.end(), '\n'), 4);
}

}  // namespace
}  // namespace demslam
