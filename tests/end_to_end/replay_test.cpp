// A recorded run solved again without its images.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "program.h"

namespace demslam {
namespace {

using namespace testing_support;

class Replay : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) /
              ("replay_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(folder_);
    recorded_ = folder_ / "recorded";
    const Outcome run =
        run_program("run '" DEMSLAM_TINY_DATASET "' -o '" + recorded_.string() + "' --no-loops", folder_);
    ASSERT_EQ(run.status, 0) << run.err;
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path replay(const std::string& name, const std::string& more) {
    const fs::path output = folder_ / name;
    last_ = run_program("replay '" + recorded_.string() + "' -o '" + output.string() + "' --no-loops " + more, folder_);
    return output;
  }

  static std::vector<double> numbers(const fs::path& file) {
    std::istringstream lines(read_text(file));
    std::vector<double> all;
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with('#')) continue;
      std::istringstream words(line);
      for (double number = 0.0; words >> number;) all.push_back(number);
    }
    return all;
  }
  static void expect_same(const fs::path& a, const fs::path& b) {
    const auto left = numbers(a), right = numbers(b);
    ASSERT_FALSE(left.empty());
    ASSERT_EQ(left.size(), right.size());
    for (std::size_t i = 0; i < left.size(); ++i) ASSERT_NEAR(left[i], right[i], 1e-6) << i;
  }

  fs::path folder_, recorded_;
  Outcome last_;
};

TEST_F(Replay, WithTheSameOptionsEndsWhereTheRunDid) {
  const fs::path again = replay("again", "-c '" + (recorded_ / "config.toml").string() + "'");
  ASSERT_EQ(last_.status, 0) << last_.err;
  expect_same(recorded_ / "trajectory.tum", again / "trajectory.tum");
  expect_same(recorded_ / "odometry.tum", again / "odometry.tum");
  EXPECT_TRUE(nlohmann::json::parse(read_text(again / "summary.json"))["anchored"]);
}

TEST_F(Replay, WithoutTheDemIsTheOdometry) {
  const fs::path bare = replay("bare", "--no-dem");
  ASSERT_EQ(last_.status, 0) << last_.err;
  expect_same(recorded_ / "odometry.tum", bare / "trajectory.tum");
}

TEST_F(Replay, OfARunWithoutAMapIsRefused) {
  fs::remove(recorded_ / "map.db");
  replay("none", "");
  EXPECT_TRUE(last_.is_one_line_error()) << last_.err;
  EXPECT_THAT(last_.err, testing::HasSubstr("map.db"));
}

}  // namespace
}  // namespace demslam
