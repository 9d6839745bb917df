#include "demslam/features/onnx_graph.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "demslam/base/error.h"
#include "demslam/base/random.h"
#include "demslam/features/built_in_model.h"
#include "demslam/features/test_onnx.h"

namespace demslam {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;
using Graph = test::OnnxGraph;

Graph small_graph() {
  Graph graph;
  graph.input("x", {1, -1, 2});
  graph.constant("w", {2, 1}, std::vector<float>{3.0F, -4.0F});
  graph.halves("h", {6}, {0x3C00, 0xC000, 0x0001, 0x7C00, 0x8000, 0x3555});
  graph.node("Foo", {"x", "w", "", "h"}, {"y"},
             {Graph::integer("one", -1), Graph::integers("many", {2, 3}), Graph::real("real", 0.5F),
              Graph::text("text", "abc"), Graph::tensor("tensor", {1, 2}, {7, 8})});
  graph.float_result("y", {1, 2});
  return graph;
}

TEST(ParseOnnx, ReadsWhatAGraphConsistsOf) {
  const OnnxGraph graph = parse_onnx(small_graph().bytes(), "test");
  EXPECT_EQ(graph.opset, 17);
  ASSERT_EQ(graph.inputs.size(), 1U);
  EXPECT_EQ(graph.inputs[0].type, "float32");
  EXPECT_THAT(graph.inputs[0].shape, ElementsAre(1, -1, 2));
  EXPECT_THAT(graph.outputs.at(0).name, "y");
  EXPECT_THAT(graph.constants.at("w").floats, ElementsAre(3.0F, -4.0F));
  ASSERT_EQ(graph.nodes.size(), 1U);
  const OnnxNode& node = graph.nodes[0];
  EXPECT_EQ(node.op, "Foo");
  EXPECT_THAT(node.inputs, ElementsAre("x", "w", "", "h"));
  EXPECT_EQ(std::get<std::int64_t>(node.attributes.at("one")), -1);
  EXPECT_THAT(std::get<std::vector<std::int64_t>>(node.attributes.at("many")), ElementsAre(2, 3));
  EXPECT_EQ(std::get<float>(node.attributes.at("real")), 0.5F);
  EXPECT_EQ(std::get<std::string>(node.attributes.at("text")), "abc");
  EXPECT_THAT(std::get<OnnxConstant>(node.attributes.at("tensor")).integers, ElementsAre(7, 8));
}

TEST(ParseOnnx, TurnsHalvesIntoFloats) {
  const OnnxConstant half = parse_onnx(small_graph().bytes(), "test").constants.at("h");
  EXPECT_THAT(half.floats, ElementsAre(1.0F, -2.0F, 0x1p-24F, INFINITY, -0.0F, 0.333251953125F));
}

TEST(ParseOnnx, SaysOfATruncatedGraphThatItIs) {
  const std::string whole = small_graph().bytes();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_THAT([&] { parse_onnx(whole.substr(0, size), "cut.onnx"); },
                ThrowsMessage<Error>(HasSubstr("cut.onnx: not a usable ONNX model, or truncated")))
        << size;
  }
}

TEST(ParseOnnx, NeverReadsBeyondADamagedFile) {
  const std::string_view whole = built_in_models()[1].graph;
  Random random(5);
  for (int i = 0; i < 300; ++i) {
    std::string damaged(whole.substr(0, 200'000));
    for (int k = 0; k < 20; ++k) {
      damaged[static_cast<std::size_t>(random.uniform() * static_cast<double>(damaged.size()))] =
          static_cast<char>(random.uniform() * 256.0);
    }
    try {
      parse_onnx(damaged, "damaged");
    } catch (const Error&) {  // what matters is that nothing else happens
    }
  }
}

TEST(ParseOnnx, RefusesValuesThatAreUsedBeforeTheyAreMade) {
  Graph graph;
  graph.input("x", {1});
  graph.node("Relu", {"z"}, {"y"});
  graph.float_result("y", {1});
  EXPECT_THAT([&] { parse_onnx(graph.bytes(), "test"); },
              ThrowsMessage<Error>(HasSubstr("'z' is used before it is made")));
}

TEST(ParseOnnx, RefusesConstantsThatDoNotFillTheirShape) {
  for (const std::vector<std::int64_t>& shape :
       {std::vector<std::int64_t>{3}, {-1}, {1LL << 62, 1LL << 62}, {1LL << 40}}) {
    Graph graph;
    graph.input("x", {1});
    graph.constant("c", shape, std::vector<float>{1.0F, 2.0F});
    graph.node("Relu", {"x"}, {"y"});
    graph.float_result("y", {1});
    EXPECT_THROW(parse_onnx(graph.bytes(), "test"), Error);
  }
}

}  // namespace
}  // namespace demslam
