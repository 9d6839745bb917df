#include "demslam/features/model_info.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "demslam/base/error.h"
#include "demslam/base/sha256.h"
#include "demslam/features/frontend.h"
#include "demslam/features/test_onnx.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::ThrowsMessage;

/// A folder of its own for each test, removed afterwards.
class Models : public testing::Test {
 protected:
  Models() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~Models() override { fs::remove_all(folder_); }

  fs::path path(const std::string& name) const { return folder_ / name; }
  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(path(name)) << text;
    return path(name);
  }
  /// Two keypoints, the second one the stronger, with descriptors of `width`.
  fs::path superpoint(int width = 256) const {
    test::OnnxGraph graph;
    graph.input("image", {1, 1, -1, -1});
    graph.output("keypoints", {1, 2, 2}, std::vector<std::int64_t>{10, 20, 31, 12});
    graph.output("scores", {1, 2}, std::vector<float>{0.25F, 0.75F});
    graph.output("descriptors", {1, 2, width}, std::vector<float>(2 * width, 2.0F));
    graph.save(path("superpoint.onnx"));
    return path("superpoint.onnx");
  }
  /// Says that 0-1 (0.9), 1-1 (0.8), 1-0 (0.05) match.
  fs::path lightglue(int width = 256) const {
    test::OnnxGraph graph;
    for (const std::string side : {"0", "1"}) {
      graph.input("kpts" + side, {1, -1, 2});
      graph.input("desc" + side, {1, -1, width});
    }
    graph.output("matches0", {3, 2}, std::vector<std::int64_t>{1, 1, 0, 1, 1, 0});
    graph.output("mscores0", {3}, std::vector<float>{0.8F, 0.9F, 0.05F});
    graph.save(path("lightglue.onnx"));
    return path("lightglue.onnx");
  }

 private:
  fs::path folder_ = fs::path(testing::TempDir()) / testing::UnitTest::GetInstance()->current_test_info()->name();
};

TEST_F(Models, RecognisesSuperPointByItsInputsAndOutputs) {
  const ModelInfo info = inspect_model(superpoint());
  EXPECT_EQ(info.contract, Contract::superpoint);
  EXPECT_EQ(info.descriptor_width, 256);
  EXPECT_EQ(info.sha256, sha256_of_file(superpoint()));
  ASSERT_EQ(info.inputs.size(), 1U);
  EXPECT_EQ(info.inputs[0].name, "image");
  EXPECT_EQ(info.outputs.size(), 3U);
}

TEST_F(Models, SuperPointGivesItsKeypointsBestFirstWithUnitDescriptors) {
  const Frontend frontend = make_frontend({.extractor = "onnx", .extractor_model = superpoint()});
  const Features features = frontend.extractor->extract(Image(64, 48, 100));
  ASSERT_EQ(features.size(), 2U);
  EXPECT_EQ(features.keypoints[0], Eigen::Vector2f(31, 12));
  EXPECT_EQ(features.keypoints[1], Eigen::Vector2f(10, 20));
  EXPECT_EQ(features.scores[0], 0.75F);
  EXPECT_NEAR(features.descriptors.row(0).norm(), 1.0F, 1e-6F);
  EXPECT_EQ(features.image_width, 64);
}

TEST_F(Models, ALightGlueMatcherIsMadeOneToOneAboveItsScore) {
  const Frontend frontend = make_frontend(
      {.extractor = "onnx", .matcher = "onnx", .extractor_model = superpoint(), .matcher_model = lightglue()});
  const Features features = frontend.extractor->extract(Image(64, 48, 100));
  const std::vector<Match> matches = frontend.matcher->match(features, features);
  ASSERT_EQ(matches.size(), 1U);
  EXPECT_EQ(matches[0].query, 0);
  EXPECT_EQ(matches[0].train, 1);
  EXPECT_EQ(matches[0].score, 0.9F);
}

TEST_F(Models, RefusesAMatcherForOtherDescriptors) {
  FrontendOptions options{
      .extractor = "onnx", .matcher = "onnx", .extractor_model = superpoint(), .matcher_model = lightglue(64)};
  EXPECT_THAT([&] { make_frontend(options); },
              ThrowsMessage<Error>(HasSubstr("width 64, but the extractor gives width 256")));
  options.extractor = "classical";
  EXPECT_THAT([&] { make_frontend(options); },
              ThrowsMessage<Error>(HasSubstr("width 64, but the extractor gives width 128")));
}

TEST_F(Models, RefusesAModelInTheWrongRole) {
  EXPECT_THAT([&] { make_frontend({.extractor = "onnx", .extractor_model = lightglue()}); },
              ThrowsMessage<Error>(HasSubstr("contract lightglue is no extractor")));
  EXPECT_THAT([&] { make_frontend({.matcher = "onnx", .matcher_model = superpoint()}); },
              ThrowsMessage<Error>(HasSubstr("contract superpoint is no matcher")));
}

TEST_F(Models, RefusesWhatIsNoModelInOneLine) {
  EXPECT_THAT([&] { inspect_model(path("missing.onnx")); },
              ThrowsMessage<Error>(HasSubstr("missing.onnx: no such model file")));
  EXPECT_THAT([&] { inspect_model(write("text.onnx", "not a graph")); },
              ThrowsMessage<Error>(AllOf(HasSubstr("not a usable ONNX model"), Not(HasSubstr("\n")))));
  const fs::path whole = superpoint();
  fs::resize_file(whole, fs::file_size(whole) / 2);
  EXPECT_THAT([&] { inspect_model(whole); }, ThrowsMessage<Error>(HasSubstr("not a usable ONNX model, or truncated")));
}

TEST_F(Models, RefusesUnknownInputsAndOutputsAndListsThem) {
  test::OnnxGraph graph;
  graph.input("image", {1, 3, -1, -1});
  graph.output("classes", {1, 2}, std::vector<float>{0.5F, 0.5F});
  graph.save(path("classifier.onnx"));
  EXPECT_THAT([&] { inspect_model(path("classifier.onnx")); },
              ThrowsMessage<Error>(HasSubstr("image float32[1,3,?,?] -> classes float32[1,2]")));
}

TEST_F(Models, RefusesAFusedPipelineWithTheReason) {
  test::OnnxGraph graph;
  graph.input("images", {-1, 1, -1, -1});
  graph.output("keypoints", {2, 1, 2}, std::vector<std::int64_t>{1, 2, 3, 4});
  graph.output("matches", {1, 3}, std::vector<std::int64_t>{0, 0, 0});
  graph.output("mscores", {1}, std::vector<float>{1.0F});
  graph.save(path("pipeline.onnx"));
  EXPECT_THAT([&] { inspect_model(path("pipeline.onnx")); }, ThrowsMessage<Error>(HasSubstr("fused pipeline")));
}

TEST_F(Models, ReadsTheCardAndChecksIt) {
  const fs::path model = superpoint();
  const std::string hash = "sha256 = '" + sha256_of_file(model) + "'\n";
  write("superpoint.onnx.toml", "name = 'Test'\nlicence = 'MIT'\ncontract = 'superpoint'\n" + hash);
  EXPECT_EQ(inspect_model(model).card.licence, "MIT");
  write("superpoint.onnx.toml", "contract = 'xfeat'\n" + hash);
  EXPECT_THAT([&] { inspect_model(model); },
              ThrowsMessage<Error>(HasSubstr("contract superpoint, its card says xfeat")));
  write("superpoint.onnx.toml", "normalisation = 'imagenet'\n");
  EXPECT_THAT([&] { inspect_model(model); },
              ThrowsMessage<Error>(HasSubstr("normalisation 'unit', its card asks for 'imagenet'")));
  write("superpoint.onnx.toml", "min_probability = 1.5\n");
  EXPECT_THAT([&] { inspect_model(model); }, ThrowsMessage<Error>(HasSubstr("a min_probability of 1.5")));
}

TEST_F(Models, RefusesAModelWhoseHashIsNotItsCards) {
  const fs::path model = superpoint();
  write("superpoint.onnx.toml", "sha256 = '" + std::string(64, '0') + "'\n");
  EXPECT_THAT([&] { inspect_model(model); }, ThrowsMessage<Error>(HasSubstr("its card says 0000")));
}

}  // namespace
}  // namespace demslam
