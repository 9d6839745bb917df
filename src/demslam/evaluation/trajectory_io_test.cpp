#include "demslam/evaluation/trajectory_io.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "demslam/base/error.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::ThrowsMessage;

auto parsing(const std::string& text) {
  return [text] { parse_trajectory(text, "t.txt"); };
}

TEST(TrajectoryIo, TumStampsAreExact) {
  const TrajectoryFile file = parse_trajectory("# t x y z q\n1403715529.112143517 1 2 3 0 0 0.6 0.8\n", "t.txt");
  EXPECT_EQ(file.format, TrajectoryFormat::tum);
  ASSERT_EQ(file.poses.size(), 1U);
  EXPECT_EQ(file.poses[0].t_ns, 1403715529112143517);
  EXPECT_DOUBLE_EQ(file.poses[0].pose.rotation().w(), 0.8);
  EXPECT_DOUBLE_EQ(file.poses[0].pose.rotation().z(), 0.6);
  EXPECT_DOUBLE_EQ(file.poses[0].pose.translation().y(), 2.0);
}

TEST(TrajectoryIo, TumStampsThatCannotBeSecondsAreNanoseconds) {
  const TrajectoryFile file = parse_trajectory("1625657732290284032.000000 0 0 0 0 0 0 1\n", "t.txt");
  EXPECT_EQ(file.poses[0].t_ns, 1625657732290284032);
  EXPECT_EQ(parse_trajectory("1.625657732290284032e+18 0 0 0 0 0 0 1\n", "t.txt").poses[0].t_ns, 1625657732290284032);
}

TEST(TrajectoryIo, CommasMeanEurocOrderWithWFirst) {
  const TrajectoryFile file =
      parse_trajectory("#ts\n1403715524907143168,1,2,3,0.8,0,0,0.6,9,9,9,9,9,9,9,9,9\n", "gt.txt");
  EXPECT_EQ(file.format, TrajectoryFormat::euroc);
  EXPECT_EQ(file.poses[0].t_ns, 1403715524907143168);
  EXPECT_DOUBLE_EQ(file.poses[0].pose.rotation().w(), 0.8);
  EXPECT_DOUBLE_EQ(file.poses[0].pose.rotation().z(), 0.6);
}

TEST(TrajectoryIo, KittiPosesHaveAnIndexForAStamp) {
  const TrajectoryFile file = parse_trajectory("1 0 0 4 0 1 0 5 0 0 1 6\n1 0 0 7 0 1 0 8 0 0 1 9\n", "poses.txt");
  EXPECT_TRUE(file.indexed);
  EXPECT_EQ(file.poses[1].t_ns, 100'000'000);
  EXPECT_TRUE(file.poses[1].pose.translation().isApprox(Eigen::Vector3d(7.0, 8.0, 9.0)));
}

TEST(TrajectoryIo, KittiPosesTakeTheStampsOfTimesTxt) {
  const fs::path folder = fs::path(testing::TempDir()) / "TrajectoryIo.Kitti";
  fs::create_directories(folder / "poses");
  fs::create_directories(folder / "sequences/00");
  std::ofstream(folder / "poses/00.txt") << "1 0 0 4 0 1 0 5 0 0 1 6\n1 0 0 7 0 1 0 8 0 0 1 9\n";
  std::ofstream(folder / "sequences/00/times.txt") << "0.0\n1.036224e-01\n";
  const TrajectoryFile file = read_trajectory(folder / "poses/00.txt");
  EXPECT_FALSE(file.indexed);
  EXPECT_EQ(file.poses[1].t_ns, 103'622'400);
  fs::remove_all(folder);
}

TEST(TrajectoryIo, BrokenFilesAreRefusedWithTheirLine) {
  const std::string good = "1.0 0 0 0 0 0 0 1\n";
  EXPECT_THAT(parsing(""), ThrowsMessage<Error>(HasSubstr("t.txt: there is no pose")));
  EXPECT_THAT(parsing("1 2 3\n"), ThrowsMessage<Error>(HasSubstr("t.txt:1: 3 columns fit no trajectory")));
  EXPECT_THAT(parsing("time,x,y\n0.2,0,0\n"), ThrowsMessage<Error>(HasSubstr("t.txt:1: 3 columns")));
  EXPECT_THAT(parsing(good + "2.0 0 0 0 0 0 1\n"), ThrowsMessage<Error>(HasSubstr("t.txt:2: 7 columns where")));
  EXPECT_THAT(parsing(good + "2.0 nan 0 0 0 0 0 1\n"), ThrowsMessage<Error>(HasSubstr("t.txt:2: 'nan'")));
  EXPECT_THAT(parsing(good + "1.0 0 0 0 0 0 0 1\n"), ThrowsMessage<Error>(HasSubstr("t.txt:2: the stamp is the same")));
  EXPECT_THAT(parsing(good + "0.5 0 0 0 0 0 0 1\n"), ThrowsMessage<Error>(HasSubstr("t.txt:2: the stamp is before")));
  EXPECT_THAT(parsing(good + "2.0 0 0 0 0 0 0 0\n"), ThrowsMessage<Error>(HasSubstr("t.txt:2: the quaternion")));
  EXPECT_THAT(parsing("2 0 0 4 0 2 0 5 0 0 2 6\n"),
              ThrowsMessage<Error>(HasSubstr("t.txt:1: the matrix is no rotation")));
}

TEST(TrajectoryIo, EveryFormatReadsBackWhatItWrites) {
  Trajectory trajectory;
  for (int i = 0; i < 3; ++i) {
    trajectory.push_back(
        {i * TimestampNs{100'000'000}, Pose(rotation_from_rpy(0.1 * i, 0.2, 0.3), {1.5 * i, -2.0, 1e3})});
  }
  for (const std::string& text : {tum_text(trajectory), kitti_text(trajectory), euroc_text(trajectory)}) {
    const Trajectory read = parse_trajectory(text, "t").poses;
    ASSERT_EQ(read.size(), 3U);
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(read[i].t_ns, trajectory[i].t_ns);
      EXPECT_TRUE(read[i].pose.matrix().isApprox(trajectory[i].pose.matrix(), 1e-10)) << text;
    }
  }
}

TEST(TrajectoryIo, PositionsAloneHaveNoRotation) {
  EXPECT_FALSE(has_rotation(parse_trajectory("1 5 0 0 0 0 0 1\n2 6 0 0 0 0 0 1\n", "t").poses));
  EXPECT_TRUE(has_rotation(parse_trajectory("1 5 0 0 0 0 0 1\n2 6 0 0 0 0 0.6 0.8\n", "t").poses));
}

TEST(TrajectoryIo, RefusesTheDuplicateInTheRealFreiburgTruth) {
  const fs::path file = fs::path(DEMSLAM_SHARED_DIR) / "data/trajectories/fr2_desk_groundtruth.txt";
  if (!fs::exists(file)) GTEST_SKIP() << file << " is not here";
  EXPECT_THAT([&] { read_trajectory(file); }, ThrowsMessage<Error>(HasSubstr("the stamp is the same")));
}

}  // namespace
}  // namespace demslam
