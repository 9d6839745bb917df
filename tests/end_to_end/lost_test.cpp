// Cameras that see nothing for a while.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "demslam/image/image.h"
#include "program.h"

namespace demslam {
namespace {

using namespace testing_support;
using Json = nlohmann::json;

class Lost : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) /
              ("lost_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    dataset_ = folder_ / "data";
    fs::copy(DEMSLAM_TINY_DATASET, dataset_, fs::copy_options::recursive);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::vector<fs::path> images(const std::string& camera) const {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(dataset_ / camera / "color")) files.push_back(entry.path());
    std::ranges::sort(files, {}, [](const fs::path& file) { return std::stoll(file.stem().string()); });
    return files;
  }
  void run() {
    const Outcome outcome =
        run_program("run '" + dataset_.string() + "' -o '" + (folder_ / "run").string() + "' --no-dem", folder_);
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    std::istringstream lines(read_text(folder_ / "run" / "frames.jsonl"));
    for (std::string line; std::getline(lines, line);) records_.push_back(Json::parse(line));
  }
  Json evaluate() {
    const fs::path json = folder_ / "evaluation.json";
    run_program("evaluate '" + (folder_ / "run").string() + "' --json '" + json.string() + "'", folder_);
    const Json parsed = Json::parse(read_text(json));
    return parsed.is_array() ? parsed.at(0) : parsed;
  }

  fs::path folder_, dataset_;
  std::vector<Json> records_;
};

TEST_F(Lost, ABlackoutIsBridgedReportedAndCountedAgainstCompletion) {
  for (const std::string camera : {"image0", "image1"}) {
    const auto files = images(camera);
    for (int i = 12; i < 20; ++i) write_image(files[i], Image(320, 320, 2));
  }
  run();
  for (int i = 12; i < 20; ++i) {
    EXPECT_EQ(records_[i]["status"], "bridged") << i;
    EXPECT_EQ(records_[i]["reason"], "dark frame") << i;
    EXPECT_NEAR(records_[i]["sigma_m"], 0.5 * (i - 11), 0.2 + 0.1 * (i - 11)) << i;  // half a metre per second, 1 Hz
  }
  for (std::size_t i = 22; i < records_.size(); ++i) EXPECT_EQ(records_[i]["status"], "tracked") << i;
  const Json evaluation = evaluate();
  EXPECT_LT(evaluation["completion"], 1.0 - 8.0 / 32.0);
  EXPECT_GT(evaluation["completion"], 0.6);
  EXPECT_LT(evaluation["ate_rmse_m"], 2.0);  // 3.2 m in the dark
}

TEST_F(Lost, AFrozenCameraIsToldFromARoverThatStands) {
  for (const std::string camera : {"image0", "image1"}) {
    const auto files = images(camera);
    for (int i = 10; i < 13; ++i) fs::copy_file(files[9], files[i], fs::copy_options::overwrite_existing);
  }
  run();
  for (int i = 10; i < 13; ++i) EXPECT_EQ(records_[i]["reason"], "frozen frame") << i;
  EXPECT_EQ(records_.back()["status"], "tracked");
}

TEST_F(Lost, FramesThreeSecondsApartAreFollowed) {
  for (const std::string camera : {"image0", "image1"}) {
    const auto files = images(camera);
    for (std::size_t i = 0; i < files.size(); ++i) {
      if (i % 3 != 0) fs::remove(files[i]);
    }
  }
  run();
  ASSERT_EQ(records_.size(), 11U);
  EXPECT_EQ(std::ranges::count_if(records_, [](const Json& r) { return r["status"] == "tracked"; }), 10);
  EXPECT_LT(evaluate()["ate_rmse_m"], 0.5);
}

}  // namespace
}  // namespace demslam
