#include "demslam/toml/toml.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "demslam/base/error.h"

namespace demslam {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

struct Options {
  double ratio = 0.8;
  int count = 3;
  bool on = true;
  std::string name = "a \"quoted\" name";
  Eigen::Vector3d axis{1.0, 2.0, 3.0};
  Pose pose = Pose(rotation_from_rpy(0.1, 0.2, 0.3), {1.0, 2.0, 3.0});
};

template <class Io, class O>
void fields(Io& io, O& options) {
  io.field("ratio", options.ratio);
  io.field("count", options.count);
  io.field("on", options.on);
  io.field("name", options.name);
  io.section("inner", [&](Io& inner) {
    inner.field("axis", options.axis);
    inner.section("deep", [&](Io& deep) { deep.field("pose", options.pose); });
  });
}

TEST(Toml, ReadsBackWhatItWrites) {
  Options written{.ratio = 0.1 + 0.2, .count = -7, .on = false, .axis = {1e-9, 5.0, -0.1}};
  TomlWriter writer;
  fields(writer, written);
  Options read{.name = ""};
  TomlReader reader = TomlReader::from_text(writer.text(), "o.toml");
  fields(reader, read);
  reader.reject_unknown();
  EXPECT_EQ(read.ratio, written.ratio);
  EXPECT_EQ(read.count, written.count);
  EXPECT_EQ(read.on, written.on);
  EXPECT_EQ(read.name, written.name);
  EXPECT_EQ(read.axis, written.axis);
  EXPECT_LT((read.pose.inverse() * written.pose).log().norm(), 1e-12);
}

TEST(Toml, KeepsTheDefaultWhereAKeyIsMissing) {
  Options options;
  TomlReader reader = TomlReader::from_text("count = 5\n", "o.toml");
  fields(reader, options);
  EXPECT_EQ(options.count, 5);
  EXPECT_EQ(options.ratio, 0.8);
}

TEST(Toml, RefusesAnUnknownKeyWithItsLineAndTheNearestName) {
  Options options;
  TomlReader reader = TomlReader::from_text("count = 5\nratoi = 1.0\n", "o.toml");
  fields(reader, options);
  EXPECT_THAT([&] { reader.reject_unknown(); },
              ThrowsMessage<Error>("o.toml:2: unknown key 'ratoi'; did you mean 'ratio'?"));
}

TEST(Toml, RefusesAnUnknownKeyInsideASection) {
  Options options;
  TomlReader reader = TomlReader::from_text("[inner]\naxes = [1, 2, 3]\n", "o.toml");
  EXPECT_THAT([&] { fields(reader, options); }, ThrowsMessage<Error>(HasSubstr("o.toml:2: unknown key 'inner.axes'")));
}

TEST(Toml, RefusesWrongTypesAndNumbersThatAreNone) {
  Options options;
  for (const std::string text : {"ratio = 'x'", "ratio = nan", "count = 1.5", "on = 1", "[inner]\naxis = [1, 2]"}) {
    TomlReader reader = TomlReader::from_text(text, "o.toml");
    EXPECT_THROW(fields(reader, options), Error) << text;
  }
}

TEST(Toml, RefusesATransformThatIsNotRigid) {
  Pose pose;
  TomlReader reader = TomlReader::from_text("pose = [2,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]", "o.toml");
  EXPECT_THAT([&] { reader.field("pose", pose); }, ThrowsMessage<Error>(HasSubstr("not a rigid transform")));
}

TEST(Toml, SyntaxErrorsNameTheLine) {
  EXPECT_THAT([] { TomlReader::from_text("a = 1\nb = = 2\n", "o.toml"); }, ThrowsMessage<Error>(HasSubstr("o.toml:2")));
}

}  // namespace
}  // namespace demslam
