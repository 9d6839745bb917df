#include "demslam/dataset/rosbag.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <set>

#include "demslam/base/error.h"
#include "demslam/base/text.h"
#include "demslam/dataset/rosbag_writer.h"
#include "demslam/dataset/test_folder.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;
using test::TestFolder;
using testing::HasSubstr;
using testing::ThrowsMessage;

class RealBags : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(folder_)) GTEST_SKIP() << folder_ << " is not here";
  }
  const fs::path folder_ = fs::path(DEMSLAM_SHARED_DIR) / "data/rosbag";
};

TEST_F(RealBags, EveryCompressionHoldsTheSameMessages) {
  for (const char* name : {"example.bag", "example-bz2.bag", "example-lz4.bag"}) {
    const Bag bag(folder_ / name);
    const auto poses = bag.messages("/turtle1/pose");
    ASSERT_EQ(poses.size(), 1344U) << name;
    for (const BagMessage& pose : poses) ASSERT_EQ(bag.read(pose).size(), 20U) << name;  // five floats
    EXPECT_EQ(bag.messages("/turtle1/cmd_vel").size(), 357U) << name;
    EXPECT_EQ(bag.read(bag.messages("/turtle1/cmd_vel").front()).size(), 48U) << name;  // six doubles
    EXPECT_EQ(bag.read(poses.front(), 4).size(), 4U) << name;
  }
}

TEST_F(RealBags, ConnectionsHaveTopicsAndTypes) {
  std::set<std::string> types;
  const Bag bag(folder_ / "example-lz4.bag");
  for (const BagConnection& connection : bag.connections()) types.insert(connection.type);
  EXPECT_THAT(
      types, testing::IsSupersetOf({"turtlesim/Pose", "turtlesim/Color", "geometry_msgs/Twist", "tf2_msgs/TFMessage"}));
}

TEST_F(RealBags, MessagesComeInTheOrderTheyWereReceived) {
  const Bag bag(folder_ / "example-bz2.bag");
  const auto messages = bag.messages("/tf");
  ASSERT_GT(messages.size(), 1000U);
  EXPECT_TRUE(std::is_sorted(messages.begin(), messages.end(),
                             [](const BagMessage& a, const BagMessage& b) { return a.received_ns < b.received_ns; }));
}

TEST_F(RealBags, ABagWithoutMessagesIsOpenedOrRefusedWithAReason) {
  EXPECT_TRUE(Bag(folder_ / "no-messages.bag").messages("/any").empty());
  EXPECT_THAT([&] { Bag(folder_ / "empty-file.bag"); }, ThrowsMessage<Error>(HasSubstr("is no ROS 1 bag")));
}

TEST_F(RealBags, ATruncatedBagIsRefused) {
  const TestFolder folder;
  const std::string whole = read_text(folder_ / "example-lz4.bag");
  for (const double share : {0.999, 0.9, 0.5, 0.01, 0.001}) {
    const auto file =
        folder.text("cut.bag", whole.substr(0, static_cast<std::size_t>(share * static_cast<double>(whole.size()))));
    EXPECT_THAT([&] { Bag bag(file); }, ThrowsMessage<Error>(HasSubstr("the bag is truncated"))) << share;
  }
}

class WrittenBags : public testing::TestWithParam<Compression> {};

TEST_P(WrittenBags, ReadBackWhatWasWritten) {
  const TestFolder folder;
  const auto file = folder.path() / "w.bag";
  BagWriter writer(file, GetParam());
  const std::uint32_t a = writer.add_topic("/a", "std_msgs/String", "md5", "string data\n");
  const std::uint32_t b = writer.add_topic("/b", "std_msgs/String", "md5", "string data\n");
  constexpr std::size_t kLarge = 100'000;  // so that the bag has several chunks
  for (std::uint8_t i = 0; i < 40; ++i)
    writer.write(i % 2 == 0 ? a : b, i * TimestampNs{1'500'000'000}, std::vector(kLarge + i, i));
  writer.finish();

  const Bag bag(file);
  ASSERT_EQ(bag.connections().size(), 2U);
  EXPECT_EQ(bag.connections()[1].topic, "/b");
  const auto messages = bag.messages("/b");
  ASSERT_EQ(messages.size(), 20U);
  EXPECT_EQ(messages[7].received_ns, 15 * TimestampNs{1'500'000'000});
  EXPECT_EQ(bag.read(messages[7]), std::vector<std::uint8_t>(kLarge + 15, 15));
  EXPECT_GT(messages.back().chunk, 2U);
}

INSTANTIATE_TEST_SUITE_P(Rosbag, WrittenBags, testing::Values(Compression::none, Compression::bz2, Compression::lz4),
                         [](const auto& test) { return name_of(test.param); });

TEST(Rosbag, ABagWhoseRecordingWasCutOffHasNoIndex) {
  const TestFolder folder;
  {
    BagWriter writer(folder.path() / "open.bag", Compression::none);
  }  // never finished
  EXPECT_THAT([&] { Bag bag(folder.path() / "open.bag"); }, ThrowsMessage<Error>(HasSubstr("run 'rosbag reindex'")));
}

TEST(Rosbag, ADamagedChunkIsNamed) {
  const TestFolder folder;
  const auto file = folder.path() / "d.bag";
  BagWriter writer(file, Compression::bz2);
  const std::uint32_t topic = writer.add_topic("/a", "std_msgs/String", "md5", "string data\n");
  writer.write(topic, 0, std::vector<std::uint8_t>(5000, 7));
  writer.finish();
  std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
  stream.seekp(13 + 4096 + 60);
  stream << "########";
  stream.close();
  const Bag bag(file);
  EXPECT_THAT([&] { bag.read(bag.messages("/a").front()); },
              ThrowsMessage<Error>(HasSubstr("a bz2 chunk cannot be unpacked")));
}

TEST(Rosbag, AFileThatCannotBeWrittenIsNamed) {
  EXPECT_THAT([] { BagWriter("/nowhere/x.bag", Compression::none); },
              ThrowsMessage<Error>(HasSubstr("/nowhere/x.bag")));
}

}  // namespace
}  // namespace demslam
