#include "demslam/features/learned.h"

#include <gtest/gtest.h>

#include <set>

#include "demslam/base/error.h"
#include "demslam/features/frontend.h"
#include "demslam/features/test_images.h"

namespace demslam {
namespace {

const std::filesystem::path kShared = DEMSLAM_SHARED_DIR;

/// XFeat and LighterGlue from the reference models, where they are.
class XFeatLighterGlue : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(kShared / "models/xfeat.onnx")) GTEST_SKIP() << "no reference models in " << kShared;
    frontend_ = make_frontend({.extractor = "onnx",
                               .matcher = "onnx",
                               .extractor_model = kShared / "models/xfeat.onnx",
                               .matcher_model = kShared / "models/lighterglue_l3.onnx",
                               .max_features = 500});
  }
  Features extract(const Image& image) { return frontend_.extractor->extract(image); }
  std::vector<Match> match(const Features& a, const Features& b) { return frontend_.matcher->match(a, b); }

  Frontend frontend_;
};

TEST_F(XFeatLighterGlue, AreRecognised) {
  const ModelInfo xfeat = inspect_model(kShared / "models/xfeat.onnx");
  EXPECT_EQ(xfeat.contract, Contract::xfeat);
  EXPECT_EQ(xfeat.descriptor_width, 64);
  EXPECT_EQ(inspect_model(kShared / "models/lighterglue_l3.onnx").contract, Contract::lightglue);
}

TEST_F(XFeatLighterGlue, RecoverAShiftOfAnImageWhoseSidesTheNetworkMustPad) {
  const test::Texture texture(7);
  const Features a = extract(texture.draw(330, 250)), b = extract(texture.draw(330, 250, -13.0, 5.0));
  const std::vector<Match> matches = match(a, b);
  ASSERT_GT(matches.size(), 50U);
  const test::Shift shift = test::shift_of(a, b, matches);
  EXPECT_NEAR(shift.median.x(), -13.0, 0.15);
  EXPECT_NEAR(shift.median.y(), 5.0, 0.15);
}

TEST_F(XFeatLighterGlue, KeepKeypointsInsideThePaddedImage) {
  const Features features = extract(test::Texture(2).draw(200, 100));
  ASSERT_GT(features.size(), 20U);
  for (const Eigen::Vector2f& k : features.keypoints) {
    EXPECT_LT(k.x(), 199.5F);
    EXPECT_LT(k.y(), 99.5F);
  }
  EXPECT_LT((features.descriptors.rowwise().norm().array() - 1.0F).abs().maxCoeff(), 1e-5F);
}

TEST_F(XFeatLighterGlue, GiveTheSameBytesTwice) {
  const Image image = test::Texture(3).draw(256, 192), other = test::Texture(3).draw(256, 192, 4.0, 0.0);
  const Features a = extract(image), b = extract(image), c = extract(other);
  EXPECT_EQ(a.keypoints, b.keypoints);
  EXPECT_EQ(a.scores, b.scores);
  EXPECT_EQ(a.descriptors, b.descriptors);
  const std::vector<Match> first = match(a, c), second = match(a, c);
  ASSERT_EQ(first.size(), second.size());
  for (std::size_t i = 0; i < first.size(); ++i) EXPECT_EQ(first[i].score, second[i].score);
}

TEST_F(XFeatLighterGlue, MatchNothingWithNothing) {
  const Features none{.image_width = 64, .image_height = 64}, some = extract(test::Texture(3).draw(256, 192));
  EXPECT_TRUE(match(none, some).empty());
  EXPECT_TRUE(match(some, none).empty());
  EXPECT_EQ(extract(Image()).size(), 0U);
}

TEST_F(XFeatLighterGlue, AreMostlyRightAndOneToOneOnARealStereoPair) {
  const std::filesystem::path data = kShared / "data/rover_sandbox";
  if (!std::filesystem::exists(data)) GTEST_SKIP() << "no " << data;
  const Features left = extract(read_image(data / "left/frame0100.jpg")),
                 right = extract(read_image(data / "right/frame0100.jpg"));
  const std::vector<Match> matches = match(left, right);
  ASSERT_GT(matches.size(), 200U);
  std::set<int> queries, trains;
  int on_row = 0;
  for (const Match& m : matches) {
    EXPECT_TRUE(queries.insert(m.query).second);
    EXPECT_TRUE(trains.insert(m.train).second);
    EXPECT_GT(m.score, 0.1F);
    on_row += std::abs(right.keypoints[m.train].y() - left.keypoints[m.query].y() - 3.2F) < 1.5F;
  }
  EXPECT_GT(on_row, static_cast<int>(matches.size()) * 3 / 4);
}

TEST_F(XFeatLighterGlue, RefuseClassicalDescriptors) {
  const Features classical = make_frontend({}).extractor->extract(test::Texture(3).draw(256, 192));
  EXPECT_THROW(match(classical, classical), Error);
}

}  // namespace
}  // namespace demslam
