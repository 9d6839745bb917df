// The map of one run in another one, and maps that cannot be used.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <map>

#include <nlohmann/json.hpp>
#include <sstream>

#include "program.h"

namespace demslam {
namespace {

using namespace testing_support;
using testing::HasSubstr;
using Json = nlohmann::json;

class Map : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) /
              ("map_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  Outcome run(const std::string& name, const std::string& more = "", const std::string& prefix = "") {
    return run_program("run '" DEMSLAM_TINY_DATASET "' -o '" + (folder_ / name).string() + "' " + more, folder_,
                       prefix);
  }
  fs::path map(const std::string& name) const { return folder_ / name / "map.db"; }
  double ate_m(const std::string& name) {
    const fs::path json = folder_ / "evaluation.json";
    run_program("evaluate '" + (folder_ / name).string() + "' --json '" + json.string() + "'", folder_);
    const Json parsed = Json::parse(read_text(json));
    return (parsed.is_array() ? parsed.at(0) : parsed)["ate_rmse_m"];
  }
  int keyframes_placed(const std::string& name) const {
    return Json::parse(read_text(folder_ / name / "summary.json"))["counters"]["in_earlier_map"];
  }
  void expect_error(const Outcome& outcome, const std::string& part) const {
    EXPECT_TRUE(outcome.is_one_line_error()) << "status " << outcome.status << ": " << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr(part));
  }
  /// The dataset's start, moved by (2, -1.5, 0.3) m and known to 3 m.
  fs::path vague_start() {
    const std::string text = read_text(fs::path(DEMSLAM_TINY_DATASET) / "start.toml");
    std::string numbers = text.substr(text.find('[') + 1);
    numbers.resize(numbers.find(']'));
    std::ranges::replace(numbers, ',', ' ');
    std::istringstream stream(numbers);
    std::ostringstream moved;
    moved.precision(17);
    const std::map<int, double> shift = {{3, 2.0}, {7, -1.5}, {11, 0.3}};
    double value = 0.0;
    for (int i = 0; stream >> value; ++i) {
      moved << (i == 0 ? "T_map_body = [" : ", ") << value + (shift.contains(i) ? shift.at(i) : 0.0);
    }
    write_text(folder_ / "start.toml", moved.str() + "]\nsigma_position_m = 3.0\nsigma_rotation_deg = 1.0\n");
    return folder_ / "start.toml";
  }

  fs::path folder_;
};

TEST_F(Map, ASecondRunFindsItselfInTheMapOfTheFirst) {
  ASSERT_EQ(run("first").status, 0);
  const std::string start = "--start '" + vague_start().string() + "' ";
  ASSERT_EQ(run("alone", start).status, 0);
  ASSERT_EQ(run("second", start + "--map '" + (folder_ / "first").string() + "'").status, 0) << "";
  EXPECT_GT(ate_m("alone"), 1.0);  // the start is 2.5 m off; the ground mends some of it
  EXPECT_LT(ate_m("second"), 0.1);
  EXPECT_GE(keyframes_placed("second"), 2);
}

TEST_F(Map, ARunInAMapGoesOnAfterAStopAsWithoutOne) {
  ASSERT_EQ(run("first").status, 0);
  const std::string in_first = "--map '" + map("first").string() + "' ";
  ASSERT_EQ(run("whole", in_first).status, 0);
  ASSERT_EQ(run("pieces", in_first + "--max-frames 13").status, 0);
  ASSERT_EQ(run("pieces", in_first).status, 0);
  for (const std::string name : {"trajectory.tum", "covariance.csv", "frames.jsonl", "summary.json"}) {
    EXPECT_EQ(read_text(folder_ / "whole" / name), read_text(folder_ / "pieces" / name)) << name;
  }
}

TEST_F(Map, AMissingMapIsNamed) { expect_error(run("run", "--map /nowhere/map.db"), "/nowhere/map.db"); }

TEST_F(Map, OfANewerSchemaIsRefusedAndLeftAsItIs) {
  ASSERT_EQ(run("run", "--max-frames 5").status, 0);
  std::string bytes = read_text(map("run"));
  bytes[63] = 99;  // user_version
  write_text(map("run"), bytes);
  expect_error(run("run"), "newer demslam");
  expect_error(run_program("map info '" + map("run").string() + "'", folder_), "newer demslam");
  EXPECT_EQ(read_text(map("run")), bytes);
}

TEST_F(Map, CutAnywhereIsRefusedAndLeftAsItIs) {
  ASSERT_EQ(run("run", "--max-frames 5").status, 0);
  const std::string bytes = read_text(map("run"));
  for (const double part : {0.0, 1e-5, 0.003, 0.3, 0.71, 0.999}) {
    const std::string cut = bytes.substr(0, static_cast<std::size_t>(part * static_cast<double>(bytes.size())));
    write_text(map("run"), cut);
    expect_error(run("run"), "map.db");
    expect_error(run_program("map check '" + map("run").string() + "'", folder_), "map.db");
    EXPECT_EQ(read_text(map("run")), cut);
  }
}

TEST_F(Map, AFullDiskStopsTheRunWithWholeKeyframesAndItGoesOnLater) {
  ASSERT_EQ(run("whole").status, 0);
  const std::string small_disk = "trap '' 25; ulimit -f 6000;";  // blocks of 512 bytes; SIGXFSZ ignored
  expect_error(run("full", "", small_disk), "free some space");
  EXPECT_EQ(run_program("map check '" + map("full").string() + "'", folder_).status, 0);
  ASSERT_EQ(run("full").status, 0);
  EXPECT_EQ(read_text(folder_ / "whole" / "trajectory.tum"), read_text(folder_ / "full" / "trajectory.tum"));
}

TEST_F(Map, AReadOnlyFolderIsRefusedAndLeftAsItIs) {
  const std::string as_nobody = geteuid() == 0 ? "setpriv --reuid 65534 --clear-groups" : "";  // root may write all
  if (run_program("--version", folder_, as_nobody).status != 0) GTEST_SKIP() << "nobody may not start the program";
  ASSERT_EQ(run("run", "--max-frames 5").status, 0);
  const std::string bytes = read_text(map("run"));
  fs::permissions(folder_ / "run", fs::perms(0555));
  expect_error(run("run", "", as_nobody), (folder_ / "run").string());
  EXPECT_EQ(read_text(map("run")), bytes);
  EXPECT_EQ(run_program("map info '" + map("run").string() + "'", folder_, as_nobody).status, 0);
  fs::permissions(folder_ / "run", fs::perms::owner_all);
}

}  // namespace
}  // namespace demslam
