#include "demslam/experiment/study.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "demslam/experiment/study_table.h"

namespace demslam {
namespace {

using testing::HasSubstr;

StudyScore score_of(const std::string& drive, std::uint64_t seed, const std::string& variant, double ate_m) {
  return {.drive = drive, .variant = variant, .seed = seed, .path_m = 100.0, .completion = 1.0, .ate_m = ate_m};
}

Study two_variants() {
  return {.name = "study",
          .title = "A study",
          .drives = {{"plain", {}}, {"hills", {}}},
          .variants = {{"odometry", {}}, {"anchored", {}}}};
}

TEST(Spread, IsNumpysQuartiles) {
  const Spread spread = spread_of({4.0, 1.0, 3.0, 2.0});
  EXPECT_DOUBLE_EQ(spread.median, 2.5);
  EXPECT_DOUBLE_EQ(spread.lower_quartile, 1.75);
  EXPECT_DOUBLE_EQ(spread.upper_quartile, 3.25);
  EXPECT_DOUBLE_EQ(spread.worst, 4.0);
}

TEST(Spread, OfOneRunIsThatRun) {
  const Spread spread = spread_of({0.7});
  EXPECT_DOUBLE_EQ(spread.lower_quartile, 0.7);
  EXPECT_DOUBLE_EQ(spread.worst, 0.7);
}

TEST(Spread, OfAVariantTakesItsOwnRunsAlone) {
  const std::vector<StudyScore> scores{score_of("plain", 1, "odometry", 1.0), score_of("plain", 1, "anchored", 0.1),
                                       score_of("hills", 1, "odometry", 3.0)};
  EXPECT_DOUBLE_EQ(spread_of(scores, "odometry", &StudyScore::ate_m)->median, 2.0);
  EXPECT_DOUBLE_EQ(spread_of(scores, "odometry", &StudyScore::ate_m, "hills")->median, 3.0);
  EXPECT_FALSE(spread_of(scores, "anchored", &StudyScore::ate_m, "hills"));
}

TEST(StudyTable, PutsThePublishedFigureBesideOurs) {
  const std::vector<StudyScore> scores{score_of("plain", 1, "odometry", 1.0), score_of("plain", 2, "odometry", 2.0)};
  const std::string table =
      study_markdown(two_variants(), scores, {{.drive = "plain", .variant = "odometry", .ate_m = 78.0}});
  EXPECT_THAT(table, HasSubstr("| plain | odometry | 2 | 100.0 | 1.500 (1.250 to 1.750) *[78]* |"));
  EXPECT_THAT(table, testing::Not(HasSubstr("hills")));  // nothing has been run there
}

TEST(StudyTable, CsvHoldsOneLinePerRun) {
  const std::string csv = scores_csv({score_of("plain", 7, "odometry", 0.25)});
  EXPECT_THAT(csv, HasSubstr("drive,seed,variant,path_length_m,completion,ate_rmse_m"));
  EXPECT_THAT(csv, HasSubstr("plain,7,odometry,100.0,1.0,0.25"));
}

TEST(StudyTable, LatexEscapesNames) {
  Study study = two_variants();
  study.variants.front().name = "no_dem";
  const std::string latex = study_latex(study, {score_of("plain", 1, "no_dem", 1.0)});
  EXPECT_THAT(latex, HasSubstr("plain & no\\_dem & 1.000"));
}

}  // namespace
}  // namespace demslam
