#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include <cmath>

#include "demslam/base/archive.h"
#include "demslam/base/error.h"
#include "demslam/base/memory.h"
#include "demslam/base/random.h"
#include "demslam/base/sha256.h"

namespace demslam {
namespace {

TEST(Error, NamesFileAndLine) { EXPECT_STREQ(Error::at("a.toml", 3, "no such key").what(), "a.toml:3: no such key"); }

TEST(ResidentMemory, GrowsByWhatIsWritten) {
  const double before_mib = resident_mib();
  const std::vector<char> block(64 << 20, 'x');
  EXPECT_GT(before_mib, 1.0);
  EXPECT_NEAR(resident_mib() - before_mib, 64.0, 8.0) << block.front();
}

TEST(Random, IsTheSameForTheSameSeedAndStream) {
  Random a(7, 1), b(7, 1), c(7, 2);
  const auto first = a.next();
  EXPECT_EQ(first, b.next());
  EXPECT_NE(first, c.next());
}

TEST(Random, NormalHasUnitVarianceAndZeroMean) {
  Random random(1);
  double sum = 0.0, square = 0.0;
  constexpr int n = 200000;
  for (int i = 0; i < n; ++i) {
    const double x = random.normal();
    sum += x;
    square += x * x;
  }
  EXPECT_NEAR(sum / n, 0.0, 0.01);
  EXPECT_NEAR(square / n, 1.0, 0.02);
}

struct Node {
  int number = 0;
  std::string name;
  std::vector<double> values;
  std::optional<bool> flag;

  template <class Archive>
  friend void archive(Archive& io, Node& n) {
    io(n.number, n.name, n.values, n.flag);
  }
  bool operator==(const Node&) const = default;
};

std::string archived(const std::vector<Node>& nodes) {
  ArchiveWriter io;
  io(nodes);
  return io.take();
}

TEST(Archive, ReturnsWhatWasWrittenBitForBit) {
  const std::vector<Node> nodes = {{7, "seven", {0.1 + 0.2, -0.0}, true}, {-1, "", {}, std::nullopt}};
  const std::string bytes = archived(nodes);
  ArchiveReader io(bytes);
  std::vector<Node> read;
  io(read);
  EXPECT_EQ(read, nodes);
  EXPECT_TRUE(std::signbit(read[0].values[1]));
  EXPECT_TRUE(io.empty());
}

TEST(Archive, CutAnywhereIsAnError) {
  const std::string bytes = archived({{7, "seven", {1.0, 2.0}, true}});
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    std::vector<Node> read;
    ArchiveReader io(std::string_view(bytes).substr(0, size));
    EXPECT_THROW(io(read), Error) << size;
  }
}

TEST(Sha256, KnowsThePublishedDigestOfAbc) {
  EXPECT_EQ(sha256_of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST(Sha256, RefusesAFileThatIsNotThere) {
  EXPECT_THROW({ auto digest = sha256_of_file("/no/such/file"); }, Error);
}

}  // namespace
}  // namespace demslam
