// A study from simulation to figures, on a drive of a few metres.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <stop_token>

#include "demslam/base/text.h"
#include "demslam/experiment/study.h"
#include "demslam/experiment/study_figures.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

Study short_study() {
  SceneOptions scene;
  scene.terrain.size_m = 200.0;
  scene.camera.width_px = scene.camera.height_px = 256;
  scene.rover.length_m = 4.0;
  scene.rover.speed_m_per_s = 0.4;
  scene.rover.frame_rate_hz = 1.0;
  scene.output.depth = false;
  SlamOptions odometry;
  odometry.use_dem = false;
  return {.name = "short",
          .title = "A short drive",
          .drives = {{"hills", scene}},
          .variants = {{"odometry", odometry},
                       {"anchored", {}},
                       {"biased", {}, StudyDem::ground, {.bias_m = 0.1}},
                       {"lidar", {}, StudyDem::lidar}}};
}

class RunStudy : public testing::Test {
 protected:
  void SetUp() override {
    out_ = fs::path(testing::TempDir()) / testing::UnitTest::GetInstance()->current_test_info()->name();
    fs::remove_all(out_);
  }
  void TearDown() override { fs::remove_all(out_); }

  fs::path out_;
};

TEST_F(RunStudy, ScoresEveryVariantOnTheSameOdometryAndDrawsThem) {
  const Study study = short_study();
  const std::vector<StudyScore> scores = run_study(study, out_, {});
  ASSERT_EQ(scores.size(), 4U);
  for (const StudyScore& score : scores) {
    EXPECT_DOUBLE_EQ(score.completion, 1.0) << score.variant;
    EXPECT_NEAR(score.path_m, 4.0, 0.5) << score.variant;
    EXPECT_LT(score.horizontal_m, 0.2) << score.variant;
  }
  EXPECT_NE(scores[0].ate_m, scores[1].ate_m);
  EXPECT_NE(scores[1].ate_m, scores[2].ate_m);  // another DEM
  EXPECT_NE(scores[1].ate_m, scores[3].ate_m);
  write_study_figures(study, out_);
  EXPECT_TRUE(fs::exists(out_ / "hills_map.png"));
  EXPECT_THAT(read_text(out_ / "hills_error.svg"), testing::AllOf(HasSubstr("odometry"), HasSubstr("biased")));
  EXPECT_THAT(read_text(out_ / "hills_cost.svg"), HasSubstr("memory [MiB]"));
}

TEST_F(RunStudy, SolvesAVariantAgainFromTheRecordingsThatAreKept) {
  Study study = short_study();
  study.keep_recordings = true;
  const double ate_m = run_study(study, out_, {}).back().ate_m;
  const fs::path folder = study_folder(out_, study.drives.front(), study.seeds.front());
  fs::remove_all(folder / study.variants.back().name);
  bool tracked = false;
  const std::vector<StudyScore> again =
      run_study(study, out_, {.report = [&](std::size_t, std::size_t) { tracked = true; }});
  EXPECT_FALSE(tracked);
  EXPECT_EQ(again.back().ate_m, ate_m);
}

TEST_F(RunStudy, RemovesRecordingsThatNobodyKeepsAndTracksAgainWhenOneIsNeeded) {
  const Study study = short_study();
  const double ate_m = run_study(study, out_, {}).back().ate_m;
  const fs::path folder = study_folder(out_, study.drives.front(), study.seeds.front());
  EXPECT_TRUE(fs::exists(folder / "recording" / "summary.json"));
  EXPECT_FALSE(fs::exists(folder / "recording" / "map.db"));
  fs::remove_all(folder / study.variants.back().name);
  EXPECT_EQ(run_study(study, out_, {}).back().ate_m, ate_m);
}

TEST_F(RunStudy, GoesOnWhereItWasStopped) {
  const Study study = short_study();
  std::stop_source stop;
  Progress progress{.report = [&](std::size_t done, std::size_t) { done >= 3 && stop.request_stop(); },
                    .stop = stop.get_token()};
  EXPECT_TRUE(run_study(study, out_, progress).empty());
  write_study_figures(study, out_);
  EXPECT_FALSE(fs::exists(out_ / "hills_map.png"));  // nothing to draw yet
  const std::vector<StudyScore> in_pieces = run_study(study, out_, {});
  const std::vector<StudyScore> at_once = run_study(study, out_ / "again", {});
  ASSERT_EQ(in_pieces.size(), at_once.size());
  for (std::size_t i = 0; i < at_once.size(); ++i) EXPECT_EQ(in_pieces[i].ate_m, at_once[i].ate_m);
}

}  // namespace
}  // namespace demslam
