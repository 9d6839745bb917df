#include "demslam/features/network.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <set>

#include "demslam/base/error.h"
#include "demslam/base/random.h"
#include "demslam/features/built_in_model.h"
#include "demslam/features/frontend.h"
#include "demslam/features/model_info.h"
#include "demslam/features/network_engine.h"
#include "demslam/features/open_model.h"
#include "demslam/features/test_images.h"
#include "demslam/features/test_onnx.h"

namespace demslam {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;
using testing::ThrowsMessage;
using Graph = test::OnnxGraph;
using Ints = std::vector<std::int64_t>;

const std::filesystem::path kModels = std::filesystem::path(DEMSLAM_SHARED_DIR) / "models";

std::unique_ptr<Network> network_of(const Graph& graph, std::string& why_not, bool bf16 = false) {
  return Network::build(parse_onnx(graph.bytes(), "test"), "test", {2, bf16}, why_not);
}

/// Keypoints of `a` that `b` has within half a pixel, as a share.
double shared_keypoints(const Features& a, const Features& b) {
  std::size_t found = 0;
  for (const Eigen::Vector2f& k : a.keypoints) {
    found += std::ranges::any_of(b.keypoints, [&](const Eigen::Vector2f& other) { return (k - other).norm() < 0.5F; });
  }
  return static_cast<double>(found) / static_cast<double>(a.size());
}

/// Mean cosine of the descriptors of keypoints that both have.
double mean_cosine(const Features& a, const Features& b) {
  double sum = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) {
      if ((a.keypoints[i] - b.keypoints[j]).norm() >= 0.5F) continue;
      sum += a.descriptors.row(static_cast<Eigen::Index>(i)).dot(b.descriptors.row(static_cast<Eigen::Index>(j)));
      ++count;
      break;
    }
  }
  return sum / count;
}

double shared_matches(const std::vector<Match>& a, const std::vector<Match>& b) {
  std::set<std::pair<int, int>> known;
  for (const Match& match : b) known.insert({match.query, match.train});
  const auto shared = std::ranges::count_if(a, [&](const Match& m) { return known.contains({m.query, m.train}); });
  return static_cast<double>(shared) / static_cast<double>(a.size());
}

/// An extractor and its matcher: our own, or XFeat with LighterGlue where the files are.
class WholeNetworks : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    if (GetParam() == "xfeat" && !std::filesystem::exists(kModels / "xfeat.onnx")) GTEST_SKIP() << "no " << kModels;
  }
  static Frontend frontend(const std::string& inference, int threads = 2) {
    if (GetParam() == "lunar") {
      return make_frontend(
          {.extractor = "lunar", .matcher = "lunar", .max_features = 400, .threads = threads, .inference = inference});
    }
    return make_frontend({.extractor = "onnx",
                          .matcher = "onnx",
                          .extractor_model = kModels / "xfeat.onnx",
                          .matcher_model = kModels / "lighterglue_l3.onnx",
                          .max_features = 400,
                          .threads = threads,
                          .inference = inference});
  }
  static Image view(double shift_px) { return test::Texture(7).draw(330, 250, -shift_px, 0.0); }
};

TEST_P(WholeNetworks, AreRunByWhatIsAskedFor) {
  EXPECT_EQ(frontend("onnxruntime").inference, "onnxruntime");
  EXPECT_THAT(frontend("onednn").inference, StartsWith(nn::has_native_bf16() ? "onednn bf16 " : "onednn fp32 "));
}

TEST_P(WholeNetworks, ExtractWhatOnnxRuntimeExtracts) {
  const Features a = frontend("onednn").extractor->extract(view(0.0)),
                 b = frontend("onnxruntime").extractor->extract(view(0.0));
  ASSERT_GT(b.size(), 100U);
  EXPECT_GT(shared_keypoints(b, a), 0.9);
  EXPECT_GT(mean_cosine(b, a), 0.999);
}

TEST_P(WholeNetworks, MatchWhatOnnxRuntimeMatches) {
  const Frontend one = frontend("onednn"), other = frontend("onnxruntime");
  const Features a = other.extractor->extract(view(0.0)), b = other.extractor->extract(view(9.0));
  const std::vector<Match> theirs = other.matcher->match(a, b), ours = one.matcher->match(a, b);
  ASSERT_GT(theirs.size(), 50U);
  EXPECT_GT(shared_matches(theirs, ours), 0.95);
  EXPECT_GT(shared_matches(ours, theirs), 0.95);
}

TEST_P(WholeNetworks, GiveTheSameBytesOnAnyNumberOfThreads) {
  const Frontend one = frontend("onednn", 1), four = frontend("onednn", 4);
  const Features a = one.extractor->extract(view(0.0)), b = four.extractor->extract(view(0.0)),
                 c = one.extractor->extract(view(9.0));
  EXPECT_EQ(a.keypoints, b.keypoints);
  EXPECT_EQ(a.scores, b.scores);
  EXPECT_EQ(a.descriptors, b.descriptors);
  const std::vector<Match> first = one.matcher->match(a, c), second = four.matcher->match(a, c);
  ASSERT_EQ(first.size(), second.size());
  for (std::size_t i = 0; i < first.size(); ++i) EXPECT_EQ(first[i].score, second[i].score);
}

TEST_P(WholeNetworks, ForgetNothingOfOneSizeWhenTheyHaveSeenAnother) {
  const Frontend used = frontend("onednn"), fresh = frontend("onednn");
  const Image other = test::Texture(3).draw(160, 96);
  used.extractor->extract(other);
  const Features a = used.extractor->extract(view(0.0)), b = fresh.extractor->extract(view(0.0));
  EXPECT_EQ(a.keypoints, b.keypoints);
  EXPECT_EQ(a.descriptors, b.descriptors);
  used.matcher->match(used.extractor->extract(other), a);
  const std::vector<Match> first = used.matcher->match(a, b), second = fresh.matcher->match(a, b);
  ASSERT_EQ(first.size(), second.size());
  for (std::size_t i = 0; i < first.size(); ++i) EXPECT_EQ(first[i].score, second[i].score);
}

INSTANTIATE_TEST_SUITE_P(Pairs, WholeNetworks, testing::Values("lunar", "xfeat"),
                         [](const auto& name) { return name.param; });

/// The maps of an extractor, by both backends; largest difference by the largest value.
TEST(Network, GivesInFloatTheMapsThatOnnxRuntimeGives) {
  const Image image = test::Texture(7).draw(160, 128);
  Tensor tensor{.shape = {1, 3, 128, 160}};
  for (int c = 0; c < 3; ++c) {
    for (const std::uint8_t pixel : image.pixels) tensor.floats.push_back(static_cast<float>(pixel) / 255.0F);
  }
  const std::vector<std::string> names{"descriptors", "keypoint_logits", "reliability"};
  OpenModel theirs = open_built_in_model("lunar", {.backend = "onnxruntime", .threads = 1});
  std::string why_not;
  const OnnxGraph graph = parse_onnx(built_in_models()[0].graph, "lunar");
  const auto ours = Network::build(graph, "lunar", {1, false}, why_not);
  ASSERT_TRUE(ours) << why_not;
  const auto a = ours->run({"image"}, {tensor}, names), b = theirs.session.run({"image"}, {tensor}, names);
  for (std::size_t i = 0; i < names.size(); ++i) {
    ASSERT_EQ(a[i].floats.size(), b[i].floats.size());
    float worst = 0.0F;
    for (std::size_t k = 0; k < a[i].floats.size(); ++k) {
      worst = std::max(worst, std::abs(a[i].floats[k] - b[i].floats[k]));
    }
    EXPECT_LT(worst, 1e-4F) << names[i];
  }
}

TEST(Network, SaysWhatItDoesNotCover) {
  const auto reason = [](const std::string& op, const std::vector<Graph::Attribute>& attributes) {
    Graph graph;
    graph.input("x", {1, 4, -1, -1});
    graph.constant("w", {4, 4, 3, 3}, std::vector<float>(144, 0.1F));
    graph.node(op, op == "Conv" ? std::vector<std::string>{"x", "w"} : std::vector<std::string>{"x"}, {"y"},
               attributes);
    graph.float_result("y", {-1, -1, -1, -1});
    std::string why_not;
    EXPECT_FALSE(network_of(graph, why_not));
    return why_not;
  };
  EXPECT_EQ(reason("Softplus", {}), "operator Softplus");
  EXPECT_EQ(reason("Einsum", {Graph::text("equation", "aabc->abc")}), "operator Einsum with equation 'aabc->abc'");
  EXPECT_EQ(reason("Conv", {Graph::text("auto_pad", "SAME_UPPER")}), "operator Conv with automatic padding");
  EXPECT_EQ(reason("Conv", {Graph::integer("surprise", 1)}), "operator Conv with attribute 'surprise'");
  EXPECT_THAT(reason("Resize", {Graph::text("mode", "cubic")}), HasSubstr("another mode than 'linear'"));
  EXPECT_EQ(reason("MaxPool", {Graph::integers("kernel_shape", {2, 2}), Graph::integer("ceil_mode", 1)}),
            "operator MaxPool with its window");
}

TEST(Network, FailsWithTheNodeThatCannotRun) {
  Graph graph;
  graph.input("x", {-1, -1});
  graph.constant("index", {1}, Ints{5});
  graph.node("Gather", {"x", "index"}, {"y"});
  graph.float_result("y", {-1, -1});
  std::string why_not;
  const auto network = network_of(graph, why_not);
  ASSERT_TRUE(network);
  EXPECT_THAT([&] { network->run({"x"}, {{.shape = {2, 2}, .floats = {1, 2, 3, 4}}}, {"y"}); },
              ThrowsMessage<Error>(AllOf(HasSubstr("test: the model failed while running"), HasSubstr("Gather 'y'"),
                                         HasSubstr("an index outside its tensor"))));
}

/// SuperPoint as LightGlue-ONNX exports it, with one layer in place of eight: softmax over cells, unfolding,
/// suppression by max-pooling, borders, selection of the best, descriptors read at the keypoints. For images of 96 x 64
/// pixels.
class SuperPointLike {
 public:
  SuperPointLike() {
    g_.input("image", {1, 1, 64, 96});
    backbone();
    heat_map();
    suppression();
    selection();
    descriptors();
  }
  const Graph& graph() const { return g_; }

 private:
  std::string list(const Ints& values) {
    const std::string name = "list" + std::to_string(constants_++);
    g_.constant(name, {static_cast<std::int64_t>(values.size())}, values);
    return name;
  }
  std::string scalar(float value) {
    const std::string name = "scalar" + std::to_string(constants_++);
    g_.constant(name, {}, std::vector<float>{value});
    return name;
  }
  void convolution(const std::string& from, const std::string& to, std::int64_t in, std::int64_t out,
                   std::int64_t size) {
    Random random(static_cast<std::uint64_t>(in + out));
    std::vector<float> weights;
    for (std::int64_t i = 0; i < out * in * size * size; ++i) {
      weights.push_back(static_cast<float>(random.normal()) / std::sqrt(static_cast<float>(in * size)));
    }
    g_.constant(to + "_weights", {out, in, size, size}, weights);
    g_.node("Conv", {from, to + "_weights"}, {to},
            {Graph::integers("kernel_shape", {size, size}), Graph::integers("pads", Ints(4, size / 2))});
  }
  void largest(const std::string& from, const std::string& to, std::int64_t size, std::int64_t stride) {
    g_.node("MaxPool", {from}, {to},
            {Graph::integers("kernel_shape", {size, size}), Graph::integers("strides", {stride, stride}),
             Graph::integers("pads", Ints(4, stride == 1 ? size / 2 : 0))});
  }

  void backbone() {
    convolution("image", "first", 1, 32, 3);
    g_.node("Relu", {"first"}, {"half"});
    largest("half", "quarter", 4, 4);
    convolution("quarter", "second", 32, 64, 3);
    g_.node("Relu", {"second"}, {"detail"});
    largest("detail", "cells", 2, 2);
  }
  void heat_map() {
    convolution("cells", "logits", 64, 65, 1);
    g_.node("Softmax", {"logits"}, {"odds"}, {Graph::integer("axis", 1)});
    g_.node("Slice", {"odds", list({0}), list({-1}), list({1})}, {"pixels"});
    g_.node("Transpose", {"pixels"}, {"cell_rows"}, {Graph::integers("perm", {0, 2, 3, 1})});
    g_.node("Reshape", {"cell_rows", list({1, 8, 12, 8, 8})}, {"squares"});
    g_.node("Transpose", {"squares"}, {"lines"}, {Graph::integers("perm", {0, 1, 3, 2, 4})});
    g_.node("Reshape", {"lines", list({1, 1, 64, 96})}, {"heat"});
  }
  void suppression() {  // one round: what equals the largest around it stays
    largest("heat", "around", 9, 1);
    g_.node("Equal", {"heat", "around"}, {"is_peak"});
    g_.node("Not", {"is_peak"}, {"is_none"});
    g_.node("Where", {"is_none", scalar(0.0F), "heat"}, {"peaks4"});
    g_.node("Squeeze", {"peaks4", list({0, 1})}, {"peaks"});
    g_.constant("border_rows", {2, 1}, Ints{0, 63});
    g_.constant("border", {2, 96}, std::vector<float>(192, -1.0F));
    g_.node("ScatterND", {"peaks", "border_rows", "border"}, {"inner"});
  }
  void selection() {
    g_.node("Greater", {"inner", scalar(0.02F)}, {"strong"});
    g_.node("NonZero", {"strong"}, {"places"});
    g_.node("Transpose", {"places"}, {"tuples"}, {Graph::integers("perm", {1, 0})});
    g_.node("GatherND", {"inner", "tuples"}, {"values"});
    g_.node("TopK", {"values", list({20})}, {"best", "order"}, {Graph::integer("axis", 0)});
    g_.node("Gather", {"tuples", "order"}, {"chosen"});
    g_.node("Slice", {"chosen", list({-1}), list({INT64_MIN}), list({1}), list({-1})}, {"flipped"});
    g_.node("Unsqueeze", {"flipped", list({0})}, {"keypoints"});
    g_.node("Unsqueeze", {"best", list({0})}, {"scores"});
    g_.integer_result("keypoints", {1, -1, 2});
    g_.float_result("scores", {1, -1});
  }
  void descriptors() {
    convolution("cells", "raw", 64, 32, 1);
    g_.node("ReduceL2", {"raw"}, {"norm"}, {Graph::integers("axes", {1}), Graph::integer("keepdims", 1)});
    g_.node("Clip", {"norm", scalar(1e-12F)}, {"safe"});
    g_.node("Shape", {"raw"}, {"shape"});
    g_.node("Expand", {"safe", "shape"}, {"norms"});
    g_.node("Div", {"raw", "norms"}, {"unit"});
    g_.node("Cast", {"keypoints"}, {"real"}, {Graph::integer("to", 1)});
    g_.node("Sub", {"real", scalar(3.5F)}, {"moved"});
    g_.constant("extent", {2}, std::vector<float>{91.5F, 59.5F});
    g_.node("Div", {"moved", "extent"}, {"shares"});
    g_.node("Mul", {"shares", scalar(2.0F)}, {"twice"});
    g_.node("Sub", {"twice", scalar(1.0F)}, {"grid3"});
    g_.node("Unsqueeze", {"grid3", list({1})}, {"grid"});
    g_.node("GridSample", {"unit", "grid"}, {"sampled"}, {Graph::integer("align_corners", 1)});
    g_.node("Squeeze", {"sampled", list({2})}, {"columns"});
    g_.node("Transpose", {"columns"}, {"descriptors"}, {Graph::integers("perm", {0, 2, 1})});
    g_.float_result("descriptors", {1, -1, 32});
  }

  Graph g_;
  int constants_ = 0;
};

TEST(Network, CoversWhatSuperPointConsistsOf) {
  const Graph graph = SuperPointLike().graph();
  const std::string bytes = graph.bytes();
  OnnxSession theirs(std::string_view(bytes), "test", 1);
  std::string why_not;
  const auto ours = network_of(graph, why_not);
  ASSERT_TRUE(ours) << why_not;
  const Image image = test::Texture(7).draw(96, 64);
  Tensor tensor{.shape = {1, 1, 64, 96}};
  for (const std::uint8_t pixel : image.pixels) tensor.floats.push_back(static_cast<float>(pixel) / 255.0F);
  const std::vector<std::string> names{"keypoints", "scores", "descriptors"};
  const auto a = ours->run({"image"}, {tensor}, names), b = theirs.run({"image"}, {tensor}, names);
  EXPECT_EQ(a[0].integers, b[0].integers);
  EXPECT_THAT(a[1].floats, testing::Pointwise(testing::FloatNear(1e-5F), b[1].floats));
  EXPECT_THAT(a[2].floats, testing::Pointwise(testing::FloatNear(1e-4F), b[2].floats));
}

TEST(Inference, LeavesToOnnxRuntimeWhatIsNotCovered) {
  Graph graph;
  graph.input("x", {2});
  graph.node("Softplus", {"x"}, {"y"});
  graph.float_result("y", {2});
  const std::string bytes = graph.bytes();
  Inference inference(std::string_view(bytes), "test", {.backend = "onednn", .threads = 1});
  EXPECT_EQ(inference.backend(), "onnxruntime");
  EXPECT_EQ(inference.fallback(), "operator Softplus");
  EXPECT_NEAR(inference.run({"x"}, {{.shape = {2}, .floats = {0.0F, 1.0F}}}, {"y"}).at(0).floats[0], 0.6931F, 1e-4F);
}

TEST(Inference, RefusesAnUnknownName) {
  EXPECT_THAT([] { make_frontend({.inference = "tensorflow"}); },
              ThrowsMessage<Error>(HasSubstr("unknown inference 'tensorflow'; known: auto, onnxruntime, onednn")));
}

TEST(Inference, IsResolvedWhereANetworkRunsAndLeftAloneElsewhere) {
  EXPECT_EQ(resolved({.extractor = "classical"}).inference, "auto");
  EXPECT_EQ(resolved({.extractor = "lunar"}).inference, nn::has_native_bf16() ? "onednn" : "onnxruntime");
  EXPECT_EQ(resolved({.extractor = "lunar", .inference = "onnxruntime"}).inference, "onnxruntime");
}

TEST(Inference, TellsWithTheModelWhoRunsIt) {
  const ModelInfo info = inspect_built_in_model("lunar");
  EXPECT_THAT(info.backend, StartsWith(nn::has_native_bf16() ? "onednn bf16" : "onnxruntime"));
  EXPECT_EQ(info.fallback.empty(), nn::has_native_bf16());
}

}  // namespace
}  // namespace demslam
