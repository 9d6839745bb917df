// What evo computes for the same files (evo_ape and evo_rpe), to 1e-6 relative or to the digits that are known.
#include <gtest/gtest.h>

#include "demslam/evaluation/runs.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

class KnownAnswers : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(folder_)) GTEST_SKIP() << folder_ << " is not here";
  }
  Evaluation evaluate_files(const std::string& truth, const std::string& estimate,
                            const EvaluationOptions& options = {}) const {
    return evaluate_run(folder_ / estimate, folder_ / truth, options);
  }
  const fs::path folder_ = fs::path(DEMSLAM_SHARED_DIR) / "data/trajectories";
};

const EvaluationOptions kOverTenMetres{.rpe = {.delta = 10.0, .unit = DeltaUnit::metres}};

TEST_F(KnownAnswers, KittiAbsoluteErrorAlignedInSe3) {
  EXPECT_NEAR(evaluate_files("KITTI_00_gt.txt", "KITTI_00_ORB.txt").ate_se3->rmse, 1.3034497, 1e-6 * 1.3034497);
  EXPECT_NEAR(evaluate_files("KITTI_00_gt.txt", "KITTI_00_SPTAM.txt").ate_se3->rmse, 3.7384879, 1e-6 * 3.7384879);
}

TEST_F(KnownAnswers, KittiRelativeErrorOverTenMetres) {
  const Evaluation orb = evaluate_files("KITTI_00_gt.txt", "KITTI_00_ORB.txt", kOverTenMetres);
  const Evaluation sptam = evaluate_files("KITTI_00_gt.txt", "KITTI_00_SPTAM.txt", kOverTenMetres);
  EXPECT_NEAR(orb.rpe->rmse, 0.2262613, 1e-6 * 0.2262613);
  EXPECT_NEAR(sptam.rpe->rmse, 0.2760711, 1e-6 * 0.2760711);
}

TEST_F(KnownAnswers, S3liAgainstPositionsAlone) {
  // 5 Hz positions against 30 Hz poses: within 0.05 s, as published.
  const Evaluation evaluation =
      evaluate_files("s3li_traverse_1_gt_tum.txt", "s3li_traverse_1_orbslam3.txt",
                     {.alignment = Alignment::se3, .association = {.max_difference_s = 0.05}});
  EXPECT_EQ(evaluation.poses, 2618U);
  EXPECT_NEAR(evaluation.ate.rmse, 5.519, 5e-4);
  EXPECT_FALSE(evaluation.rpe_rotation_deg);
  EXPECT_FALSE(evaluation.ate_first_pose);
  EXPECT_EQ(evaluation.notes.size(), 2U);
}

}  // namespace
}  // namespace demslam
