// demslam dataset, dem and export on the small simulated traverse: every converter and its reader, and what a user can
// get wrong, each in one line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "program.h"

namespace demslam {
namespace {

using namespace testing_support;
using testing::HasSubstr;
using Json = nlohmann::json;

class DatasetCommand : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) /
              ("dataset_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string at(const std::string& name) const { return "'" + (folder_ / name).string() + "'"; }
  Outcome run(const std::string& arguments) const { return run_program(arguments, folder_); }
  Json json_of(const std::string& arguments) const {
    const Outcome outcome = run(arguments + " --json " + at("out.json"));
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return Json::parse(read_text(folder_ / "out.json"));
  }
  void expect_error(const std::string& arguments, const std::string& part) const {
    const Outcome outcome = run(arguments);
    EXPECT_TRUE(outcome.is_one_line_error()) << "status " << outcome.status << ": " << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr(part));
  }
  void convert(const std::string& format, const std::string& name) const {
    const Outcome outcome = run("dataset convert " + tiny_ + " --to " + format + " -o " + at(name));
    EXPECT_EQ(outcome.status, 0) << outcome.err;
  }
  /// A copy of the traverse that may be damaged.
  fs::path copy() const {
    fs::copy(DEMSLAM_TINY_DATASET, folder_ / "data", fs::copy_options::recursive);
    return folder_ / "data";
  }

  static std::string tiny_dem() { return "'" DEMSLAM_TINY_DATASET "/dem.tif'"; }

  const std::string tiny_ = "'" DEMSLAM_TINY_DATASET "'";
  fs::path folder_;
};

TEST_F(DatasetCommand, EveryFormatConvertsAndTellsTheSameOfItself) {
  const Json original = json_of("dataset info " + tiny_);
  EXPECT_EQ(original["format"], "demslam");
  EXPECT_TRUE(original["has_dem"]);
  for (const auto& [format, reader] : {std::pair("demslam", "demslam"), std::pair("euroc", "euroc"),
                                       std::pair("kitti", "kitti"), std::pair("rosbag", "s3li")}) {
    const std::string name = std::string(format) + (std::string(format) == "rosbag" ? ".bag" : "");
    convert(format, name);
    const Json info = json_of("dataset info " + at(name));
    EXPECT_EQ(info["format"], reader);
    for (const char* key : {"pairs", "width_px", "height_px", "duration_s"}) EXPECT_EQ(info[key], original[key]) << key;
    EXPECT_NEAR(info["baseline_m"], original["baseline_m"], 1e-9) << format;
    EXPECT_NEAR(info["focal_px"], original["focal_px"], 1e-9) << format;
  }
}

TEST_F(DatasetCommand, CheckMeasuresTheEpipolarErrorOnTheImages) {
  const Json sound = json_of("dataset check --frames 3 " + tiny_);
  EXPECT_NEAR(sound["row_offset_px"], 0.0, 0.2);
  EXPECT_GT(sound["row_patches"], 20);
  EXPECT_TRUE(sound["warnings"].empty()) << sound["warnings"];
  std::string calibration = read_text(fs::path(DEMSLAM_TINY_DATASET) / "calibration.toml");
  write_text(folder_ / "off.toml", "row_offset_px = 2.0\n" + calibration);
  const Json off = json_of("dataset check --frames 3 --calibration " + at("off.toml") + " " + tiny_);
  EXPECT_NEAR(off["row_offset_px"], -2.0, 0.2);
  EXPECT_THAT(off["warnings"].dump(), HasSubstr("to row_offset_px of the calibration"));
}

TEST_F(DatasetCommand, AHalfWrittenImageIsNamed) {
  const fs::path data = copy();
  const fs::path victim = fs::directory_iterator(data / "image1" / "color")->path();
  fs::resize_file(victim, fs::file_size(victim) / 2);
  const Outcome outcome = run("dataset check --frames 0 " + at("data"));
  EXPECT_TRUE(outcome.is_one_line_error()) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr(victim.filename().string()));
}

TEST_F(DatasetCommand, ATruncatedBagIsRefused) {
  convert("rosbag", "whole.bag");
  for (const double share : {0.9, 0.3, 0.0001}) {
    fs::copy_file(folder_ / "whole.bag", folder_ / "cut.bag", fs::copy_options::overwrite_existing);
    fs::resize_file(folder_ / "cut.bag",
                    static_cast<std::uintmax_t>(share * static_cast<double>(fs::file_size(folder_ / "whole.bag"))));
    expect_error("dataset info " + at("cut.bag"), "cut.bag");
  }
}

TEST_F(DatasetCommand, StampsMustIncrease) {
  convert("euroc", "euroc");
  const fs::path index = folder_ / "euroc/mav0/cam0/data.csv";
  const std::string text = read_text(index);
  const std::size_t first = text.find('\n') + 1, second = text.find('\n', first) + 1;
  const std::string one = text.substr(first, second - first), rest = text.substr(second);
  write_text(index, text.substr(0, first) + one + one + rest);
  expect_error("dataset info " + at("euroc"), "data.csv:3: the stamps must increase");
  write_text(index, text.substr(0, first) + rest + one);
  expect_error("dataset info " + at("euroc"), "the stamps must increase");
}

TEST_F(DatasetCommand, BrokenPosesAreRefusedWithTheirLine) {
  const auto starting = [&](const std::string& poses) {
    write_text(folder_ / "poses.tum", poses);
    return "dataset start " + tiny_ + " --poses " + at("poses.tum") + " -o " + at("start.toml");
  };
  expect_error(starting("0 nan 0 0 0 0 0 1\n"), "poses.tum:1: 'nan'");
  expect_error(starting("0 0 0 0 0 0 0 1\n1 0 0 0 0 0 1\n"), "poses.tum:2: 7 columns");
  expect_error(starting("0 0 0 0 0 0 0 1\n0 0 0 0 0 0 0 1\n"), "poses.tum:2: the stamp is the same");
  expect_error(starting("9e9 0 0 0 0 0 0 1\n9.1e9 0 0 0 0 0 0 1\n"), "does not reach over the first frame");
  const fs::path data = copy();
  std::string start = read_text(data / "start.toml");
  const std::size_t begin = start.find("T_map_body"), end = start.find('\n', begin);
  start.replace(begin, end - begin, "T_map_body = [1,0,0,nan, 0,1,0,0, 0,0,1,0, 0,0,0,1]");
  write_text(data / "start.toml", start);
  expect_error("run " + at("data") + " -o " + at("run"), "start.toml:");
}

TEST_F(DatasetCommand, DemsInDegreesOrWithoutCrsAreRefusedWhereItMatters) {
  const std::string grid = "ncols 4\nnrows 4\nxllcorner 25.6\nyllcorner 45.0\ncellsize 0.0002\n";
  write_text(folder_ / "degrees.asc", grid + "1 2 3 4\n1 2 3 4\n1 2 3 4\n1 2 3 4\n");
  expect_error("dem info " + at("degrees.asc"), "look like degrees where metres are meant");
  expect_error("dem crop " + tiny_dem() + " --center 25 45 --radius-m 20 -o " + at("x.tif"), "no CRS");
  expect_error("dem crop " + tiny_dem() + " --heights radius -o " + at("x.tif"), "carries no CRS");
  write_text(folder_ / "t.pos", "%  GPST latitude(deg)\n2021/07/07 11:28:10.2 37.7 15.0 2500 1\n");
  expect_error("evaluate " + at("t.tum") + " --truth " + at("t.pos") + " --dem " + tiny_dem(), "carries no CRS");
}

TEST_F(DatasetCommand, ARunTakesTheDemsUncertaintyFromBesideIt) {
  copy();
  const std::string copied = "run " + at("data") + " --max-frames 8 -o ";
  ASSERT_EQ(run(copied + at("plain")).status, 0);
  ASSERT_EQ(run("dem perturb " + tiny_dem() + " --bias-m 0 -o " + at("data/dem_sigma.tif")).status, 0);
  ASSERT_EQ(run(copied + at("with")).status, 0);
  const Json summary = Json::parse(read_text(folder_ / "with/summary.json"));
  EXPECT_THAT(summary["inputs"]["dem_sigma"]["path"].get<std::string>(), HasSubstr("dem_sigma.tif"));
  EXPECT_NE(read_text(folder_ / "plain/trajectory.tum"), read_text(folder_ / "with/trajectory.tum"));
  ASSERT_EQ(run("replay " + at("with") + " -o " + at("again")).status, 0);
  EXPECT_EQ(Json::parse(read_text(folder_ / "again/summary.json"))["inputs"]["dem_sigma"],
            summary["inputs"]["dem_sigma"]);
  expect_error(copied + at("none") + " --dem-sigma " + at("absent.tif"), "absent.tif");
}

TEST_F(DatasetCommand, CompareMeasuresWhatPerturbDid) {
  ASSERT_EQ(run("dem perturb " + tiny_dem() + " --bias-m 0.75 -o " + at("biased.tif")).status, 0);
  const Json compared = json_of("dem compare " + at("biased.tif") + " " + tiny_dem() + " -o " + at("difference.tif"));
  EXPECT_NEAR(compared["median_m"], 0.75, 1e-4);
  EXPECT_NEAR(compared["nmad_m"], 0.0, 1e-4);
  const Json difference = json_of("dem info " + at("difference.tif"));
  EXPECT_NEAR(difference["max_m"], 0.75, 1e-3);
}

}  // namespace
}  // namespace demslam
