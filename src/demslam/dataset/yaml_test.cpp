#include "demslam/dataset/yaml.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "demslam/base/error.h"

namespace demslam {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(Yaml, ReadsOpenCvsDialect) {
  const Yaml yaml = Yaml::from_text(
      "%YAML:1.0\n---\nCamera1.fx: 435.2\nStereo.T: !!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: f\n"
      "   data: [1, 0, 0, 0.06,\n 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1.000000]\n",
      "o.yaml");
  EXPECT_DOUBLE_EQ(yaml["Camera1.fx"].number(), 435.2);
  EXPECT_DOUBLE_EQ(yaml["Stereo.T"].pose().translation().x(), 0.06);
}

TEST(Yaml, ReadsNestedRows) {
  const Yaml yaml =
      Yaml::from_text("T:\n- [1, 0, 0, 5]\n- [0, 1, 0, 6]\n- [0, 0, 1, 7]\n- [0, 0, 0, 1]\nk: [1, 2.5]\n", "k.yaml");
  EXPECT_DOUBLE_EQ(yaml["T"].pose().translation().z(), 7.0);
  EXPECT_THAT(yaml["k"].numbers(), ElementsAre(1.0, 2.5));
}

TEST(Yaml, ErrorsNameFileAndLine) {
  const Yaml yaml = Yaml::from_text(
      "%YAML:1.0\na: [1, x]\nb:\n  c: .nan\nT: [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1]\n", "e.yaml");
  EXPECT_THAT([&] { yaml["a"].numbers(); }, ThrowsMessage<Error>(HasSubstr("e.yaml:2: 'a' must hold finite numbers")));
  EXPECT_THAT([&] { yaml["b"]["c"].number(); }, ThrowsMessage<Error>(HasSubstr("e.yaml:4: 'b.c' must hold")));
  EXPECT_THAT([&] { yaml["b"]["d"]; }, ThrowsMessage<Error>(HasSubstr("key 'b.d' is missing")));
  EXPECT_THAT([&] { yaml["T"].pose(); },
              ThrowsMessage<Error>(HasSubstr("e.yaml:5: the matrix is not a rigid transform")));
}

}  // namespace
}  // namespace demslam
