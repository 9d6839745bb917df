// What a user can get wrong: each gives exit status 1 and one line that says what, where and what to do.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <regex>

#include "demslam/image/image.h"
#include "program.h"

namespace demslam {
namespace {

using namespace testing_support;
using testing::HasSubstr;

class BadInput : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) /
              ("bad_input_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    dataset_ = folder_ / "data";
    fs::copy(DEMSLAM_TINY_DATASET, dataset_, fs::copy_options::recursive);
  }
  void TearDown() override { fs::remove_all(folder_); }

  Outcome run(const std::string& more = "") {
    return run_program("run '" + dataset_.string() + "' -o '" + (folder_ / "run").string() + "' " + more, folder_);
  }
  Outcome simulate() {
    return run_program("simulate '" + (folder_ / "s.toml").string() + "' -o '" + (folder_ / "out").string() + "'",
                       folder_);
  }
  /// The n-th image of a camera, in time order.
  fs::path image(const std::string& camera, std::size_t n) const {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(dataset_ / camera / "color")) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files.at(n);
  }
  void replace_in(const fs::path& file, const std::string& from, const std::string& to) const {
    std::string text = read_text(file);
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from << " is not in " << file;
    text.replace(at, text.find('\n', at) - at, to);
    write_text(file, text);
  }
  void expect_error(const Outcome& outcome, const std::string& part) const {
    EXPECT_TRUE(outcome.is_one_line_error()) << "status " << outcome.status << ": " << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr(part));
  }

  fs::path folder_, dataset_;
};

TEST_F(BadInput, AMissingRightImageIsNamed) {
  const fs::path victim = image("image1", 3);
  fs::remove(victim);
  expect_error(run(), victim.filename().string());
}

TEST_F(BadInput, ATruncatedImageIsNamedAndWhatWasDoneIsKept) {
  const fs::path victim = image("image0", 5);
  fs::resize_file(victim, fs::file_size(victim) / 2);
  expect_error(run(), victim.filename().string());
  EXPECT_THAT(read_text(folder_ / "run" / "summary.json"), HasSubstr("\"interrupted\": true"));
  EXPECT_FALSE(read_text(folder_ / "run" / "trajectory.tum").empty());
}

TEST_F(BadInput, ImagesOfAnotherSizeThanTheCalibrationAreRefused) {
  std::string text = read_text(dataset_ / "calibration.toml");
  text = std::regex_replace(text, std::regex("width = [0-9]+"), "width = 640");
  write_text(dataset_ / "calibration.toml", text);
  expect_error(run(), "640");
}

TEST_F(BadInput, ARightImageOfAnotherSizeThanTheLeftOneIsNamed) {
  const fs::path victim = image("image1", 2);
  write_image(victim, Image(100, 80));
  expect_error(run(), victim.filename().string());
}

TEST_F(BadInput, AZeroBaselineIsRefused) {
  const std::string text = read_text(dataset_ / "calibration.toml");
  replace_in(dataset_ / "calibration.toml",
             text.find("baseline_m") != std::string::npos ? "baseline_m" : "T_left_right", "baseline_m = 0.0");
  expect_error(run(), "baseline");
}

TEST_F(BadInput, AZeroFocalLengthIsRefused) {
  replace_in(dataset_ / "calibration.toml", "fx = ", "fx = 0.0");
  expect_error(run(), "focal length");
}

TEST_F(BadInput, ADemThatDoesNotCoverTheStartIsRefused) {
  replace_in(dataset_ / "start.toml", "T_map_body",
             "T_map_body = [1, 0, 0, 90000, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]");
  expect_error(run(), "no height at the start");
}

TEST_F(BadInput, ADemOfHolesIsRefused) {
  const fs::path holes = folder_ / "holes.asc";
  std::string text = "ncols 60\nnrows 60\nxllcorner -150\nyllcorner -150\ncellsize 5\nNODATA_value -99999\n";
  for (int row = 0; row < 60; ++row) {
    for (int col = 0; col < 60; ++col) text += "-99999 ";
    text += "\n";
  }
  write_text(holes, text);
  expect_error(run("--dem '" + holes.string() + "'"), "hole");
}

TEST_F(BadInput, AnUnknownConfigurationKeyIsNamedWithItsLine) {
  write_text(folder_ / "c.toml", "[odometry]\nmin_inlires = 4\n");
  expect_error(run("-c '" + (folder_ / "c.toml").string() + "'"), "c.toml:2: unknown key 'odometry.min_inlires'");
}

TEST_F(BadInput, AWrongModelFileIsRefused) {
  write_text(folder_ / "model.onnx", "this is no network");
  expect_error(run("--extractor '" + (folder_ / "model.onnx").string() + "'"), "model.onnx");
}

TEST_F(BadInput, AnUnwritableOutputIsRefused) {
  expect_error(run_program("run '" + dataset_.string() + "' -o /dev/null/run", folder_), "/dev/null/run");
}

TEST_F(BadInput, AnEmptyDatasetIsRefused) {
  fs::remove_all(dataset_ / "image0" / "color");
  fs::create_directories(dataset_ / "image0" / "color");
  expect_error(run(), dataset_.string());
}

TEST_F(BadInput, AFolderThatIsNoDatasetIsRefused) {
  fs::create_directories(folder_ / "nothing");
  expect_error(
      run_program("run '" + (folder_ / "nothing").string() + "' -o '" + (folder_ / "run").string() + "'", folder_),
      "nothing");
}

TEST_F(BadInput, AFinishedRunIsNotOverwritten) {
  ASSERT_EQ(run("--max-frames 3").status, 0);
  const std::string before = read_text(folder_ / "run" / "trajectory.tum");
  expect_error(run("--max-frames 3"), "--overwrite");
  EXPECT_EQ(read_text(folder_ / "run" / "trajectory.tum"), before);
}

TEST_F(BadInput, ASunBelowTheHorizonIsNamedWithItsLine) {
  write_text(folder_ / "s.toml", "[light]\nsun_elevation_deg = -1.0\n");
  expect_error(simulate(), "s.toml:2: 'sun_elevation_deg': the sun is below the horizon");
}

TEST_F(BadInput, ARouteThatLeavesTheTerrainIsNamedWithThePlace) {
  write_text(folder_ / "s.toml", "[terrain]\nsize_m = 40.0\n[rover]\nlength_m = 30.0\n");
  expect_error(simulate(), "the route leaves the terrain at map x = ");
}

TEST_F(BadInput, ARouteThroughAHoleIsNamedWithThePlace) {
  std::string text = "ncols 40\nnrows 40\nxllcorner -20\nyllcorner -20\ncellsize 1\nNODATA_value -99999\n";
  for (int row = 0; row < 40; ++row) {
    for (int col = 0; col < 40; ++col) text += col == 30 ? "-99999 " : "0 ";
    text += "\n";
  }
  write_text(folder_ / "hole.asc", text);
  write_text(folder_ / "s.toml", "[terrain]\ndem = \"hole.asc\"\n[rover]\nlength_m = 15.0\n");
  expect_error(simulate(), "the route crosses a hole (no data) of the DEM at map x = ");
}

TEST_F(BadInput, ARenderedDatasetWhoseTerrainIsGoneIsNamed) {
  fs::remove_all(dataset_ / "image0");
  write_text(dataset_ / "scene.toml", "[terrain]\ndem = \"gone.tif\"\n");
  expect_error(run(), "gone.tif");
}

TEST_F(BadInput, ASceneWithATypoIsNamedWithItsLine) {
  write_text(folder_ / "s.toml", "seed = 1\n[light]\nsun_elevaton_deg = 3.0\n");
  expect_error(simulate(), "s.toml:3: unknown key 'light.sun_elevaton_deg'");
}

}  // namespace
}  // namespace demslam
