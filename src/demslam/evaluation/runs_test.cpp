#include "demslam/evaluation/runs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "demslam/base/error.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::ThrowsMessage;

class Runs : public testing::Test {
 protected:
  Runs() {
    fs::remove_all(folder_);
    write("data/gt.txt", "# ts,p,q,v,b,b\n" + truth_row(0, 0.0) + truth_row(1, 1.0) + truth_row(2, 2.0));
    write("run/summary.json", "{\"inputs\": {\"dataset\": \"" + (folder_ / "data").string() + "\"}}");
    write("run/trajectory.tum", "0.0 0.1 0 0 0 0 0 1\n1.0 1.2 0 0 0 0 0 1\n");
    write("run/frames.jsonl", "{\"t_ns\": 0}\n{\"t_ns\": 1000000000}\n{\"t_ns\": 2000000000}\n");
  }
  ~Runs() override { fs::remove_all(folder_); }

  static std::string truth_row(int second, double x) {
    return std::to_string(second * 1'000'000'000LL) + "," + std::to_string(x) + ",0,0,1,0,0,0.001,0,0,0,0,0,0,0,0,0\n";
  }
  void write(const std::string& name, const std::string& text) const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << text;
  }
  /// covariance.csv with sigma_x on the position of both keyframes.
  void write_covariances(double sigma_m) const {
    std::string text = "# covariance\nt_ns,c00\n";
    for (const char* t_ns : {"0", "1000000000"}) {
      text += t_ns;
      for (int i = 0; i < 36; ++i) text += "," + std::to_string(i % 7 == 0 ? sigma_m * sigma_m : 0.0);
      text += "\n";
    }
    write("run/covariance.csv", text);
  }

  const fs::path folder_ = fs::path(testing::TempDir()) /
                           (std::string("Runs.") + testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(Runs, ARunIsComparedWithTheTruthOfItsDataset) {
  const Evaluation e = evaluate_run(folder_ / "run", std::nullopt, {});
  EXPECT_EQ(e.poses, 2U);
  EXPECT_NEAR(e.ate.max, 0.2, 1e-9);
  EXPECT_NEAR(e.completion, 2.0 / 3.0, 1e-12);
  EXPECT_FALSE(e.nees);
}

TEST_F(Runs, CovariancesGiveTheNees) {
  write_covariances(0.1);
  const Evaluation e = evaluate_run(folder_ / "run", std::nullopt, {});
  ASSERT_TRUE(e.nees);
  EXPECT_NEAR(e.nees->position.mean, 0.5 * (1.0 + 4.0), 1e-6);
  EXPECT_THAT(evaluation_json(e), HasSubstr("nees_mean"));
}

TEST_F(Runs, ATrajectoryFileIsComparedWithAGivenTruth) {
  EXPECT_EQ(evaluate_run(folder_ / "run/trajectory.tum", folder_ / "data/gt.txt", {}).poses, 2U);
  EXPECT_EQ(evaluate_run(folder_ / "run/trajectory.tum", folder_ / "data", {}).poses, 2U);
}

TEST_F(Runs, WithoutATruthTheErrorSaysWhatToDo) {
  fs::remove(folder_ / "data/gt.txt");
  EXPECT_THAT([&] { evaluate_run(folder_ / "run", std::nullopt, {}); },
              ThrowsMessage<Error>(HasSubstr("no ground truth is found with it; pass --truth FILE")));
}

TEST_F(Runs, KittiPosesPairByIndexWithAsManyStampedOnes) {
  write("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 1 0 1 0 0 0 0 1 0\n");
  write("late.tum", "50.0 0.1 0 0 0 0 0 1\n50.1 1.2 0 0 0 0 0 1\n");
  const Evaluation e = evaluate_run(folder_ / "late.tum", folder_ / "poses.txt", {});
  EXPECT_EQ(e.poses, 2U);
  EXPECT_NEAR(e.ate.max, 0.2, 1e-9);
}

TEST_F(Runs, KittiPosesPairByTenHertzWithFewerStampedOnes) {
  write("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 1 0 1 0 0 0 0 1 0\n1 0 0 2 0 1 0 0 0 0 1 0\n");
  write("lost.tum", "0.0 0 0 0 0 0 0 1\n0.2 2.5 0 0 0 0 0 1\n");
  const Evaluation e = evaluate_run(folder_ / "lost.tum", folder_ / "poses.txt", {});
  EXPECT_EQ(e.poses, 2U);
  EXPECT_NEAR(e.ate.max, 0.5, 1e-9);
  EXPECT_NEAR(e.path_length_m, 2.0, 1e-12);
}

TEST_F(Runs, BrokenRunFilesAreNamed) {
  write("run/frames.jsonl", "{\"t_ns\": 0}\n{\"t_ns\": \n");
  EXPECT_THAT([&] { frame_stamps(folder_ / "run"); },
              ThrowsMessage<Error>(HasSubstr("frames.jsonl:2: this is no JSON")));
  write("run/covariance.csv", "0,1,2\n");
  EXPECT_THAT([&] { read_covariances(folder_ / "run"); }, ThrowsMessage<Error>(HasSubstr("covariance.csv:1: ")));
  write("run/summary.json", "{}");
  EXPECT_THAT([&] { find_truth(folder_ / "run"); }, ThrowsMessage<Error>(HasSubstr("'inputs.dataset' is missing")));
}

TEST(FindTruth, KnowsWhereEachDatasetKeepsIt) {
  const fs::path data = fs::path(DEMSLAM_SHARED_DIR) / "data";
  if (!fs::exists(data)) GTEST_SKIP() << data << " is not here";
  EXPECT_EQ(find_truth(data / "kitti_seq1"), data / "kitti_seq1/poses.txt");
  EXPECT_EQ(find_truth(data / "euroc_v101_short"), data / "euroc_v101_short/ground_truth_tum.txt");
  EXPECT_EQ(find_truth(data / "rover_sandbox"), std::nullopt);
}

}  // namespace
}  // namespace demslam
