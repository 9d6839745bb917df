// Every operator that Network covers, against ONNX Runtime on random numbers, in float and in bfloat16.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "demslam/base/random.h"
#include "demslam/features/network.h"
#include "demslam/features/network_engine.h"
#include "demslam/features/test_operators.h"

namespace demslam {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace)

std::vector<Case> cases() {
  std::vector<Case> all{
      unary("Relu"),
      unary("Sigmoid"),
      unary("Exp"),
      unary("Erf"),
      unary("Abs"),
      unary("Neg"),
      unary("Sin"),
      unary("Cos"),
      unary("Tanh"),
      unary("Floor"),
      unary("Ceil"),
      unary("Identity"),
      unary("Sqrt", true),
      unary("Log", true),
      unary("Reciprocal", true),
      binary("Add", "Same", {2, 3, 4}, {2, 3, 4}),
      binary("Sub", "Row", {2, 3, 40}, {40}),
      binary("Mul", "Column", {2, 3, 40}, {3, 1}),
      binary("Div", "Scalar", {2, 3, 4}, {}),
      binary("Add", "Both", {3, 1, 5}, {4, 1}),
      binary("Sub", "Left", {}, {2, 1500}),
      binary("Max", "Same", {2, 3, 4}, {4}),
      binary("Min", "Same", {2, 3, 4}, {4}),
      binary("Pow", "Both", {3, 4}, {3, 4}, true),
      comparison("Equal"),
      comparison("Greater"),
      comparison("GreaterOrEqual"),
      comparison("Less"),
      comparison("LessOrEqual"),
      logic("And"),
      logic("Or"),
      logic("Not"),
      convolution("Wide", {32, 32, 3, 3}, 20, {1, 1, 1, 1}, {1, 1}),
      convolution("Strided", {24, 16, 3, 3}, 21, {1, 1, 1, 1}, {2, 2}),
      convolution("Pointwise", {65, 64, 1, 1}, 18, {0, 0, 0, 0}, {1, 1}),
      convolution("NoMultipleOfSixteen", {24, 24, 3, 3}, 22, {1, 1, 1, 1}, {1, 1}),
      convolution("FewInputs", {12, 1, 3, 3}, 19, {1, 1, 1, 1}, {2, 2}),
      convolution("FewInputsManyOutputs", {40, 3, 2, 2}, 70, {0, 1, 1, 0}, {1, 2}),
      convolution("Grouped", {32, 16, 3, 3}, 12, {1, 1, 1, 1}, {1, 1}, 2),
      convolution("Dilated", {16, 16, 3, 3}, 15, {2, 2, 2, 2}, {1, 1}, 1, {2, 2}),
      convolution("InBands", {64, 64, 3, 3}, 130, {1, 1, 1, 1}, {1, 1}),
      convolution("InBandsStridedUneven", {96, 64, 5, 3}, 190, {2, 0, 1, 1}, {2, 1}),
      pool("MaxPool", "Blocks", 2, 2, 0, 0),
      pool("MaxPool", "Suppression", 9, 1, 4, 0),
      pool("AveragePool", "Blocks", 4, 4, 0, 1),
      pool("AveragePool", "Border", 5, 1, 2, 0),
      pool("AveragePool", "BorderCounted", 5, 1, 2, 1),
      resize("Scales", "half_pixel", false),
      resize("Sizes", "pytorch_half_pixel", true),
      reduction("ReduceMean", {1}, 1),
      reduction("ReduceMean", {2}, 0),
      reduction("ReduceMean", {0, 2}, 0),
      reduction("ReduceSum", {1}, 1),
      reduction("ReduceSum", {2}, 0),
      reduction("ReduceMax", {2}, 0),
      reduction("ReduceMax", {1}, 0),
      reduction("ReduceMin", {0, 1}, 1),
      reduction("ReduceL2", {1}, 1),
      along("Softmax", -1),
      along("Softmax", 1),
      along("LogSoftmax", 2),
      along("LogSoftmax", 1),
      along("LogSoftmax", 0),
      arg_max(0, 0),
      arg_max(1, 1),
      arg_max(2, 0),
      arg_max(-1, 1),
      top_k(1, 2, true),
      top_k(1, 1, true),
      top_k(1, 1, false),
      top_k(5, 2, true),
      top_k(5, 0 + 1, false),
      slice("Middle", {1, 2}, {3, 6}, {1, 2}, {1, 1}),
      slice("Backwards", {-1}, {-100}, {2}, {-1}),
      slice("Steps", {0, -5}, {100, 100}, {1, 2}, {2, 3}),
      slice("ToTheEnd", {1}, {INT64_MAX}, {0}, {1}),
  };
  all.push_back({"Where",
                 {{4, 5}, {5}},
                 [](Graph& g) {
                   g.node("Less", {"x", "y"}, {"which"});
                   g.node("Where", {"which", "x", "y"}, {"out"});
                 },
                 2});
  all.push_back({"Clip",
                 {{4, 5}},
                 [](Graph& g) {
                   g.constant("low", {}, std::vector<float>{-0.5F});
                   g.constant("high", {}, std::vector<float>{0.25F});
                   g.node("Clip", {"x", "low"}, {"above"});
                   g.node("Clip", {"above", "", "high"}, {"out"});
                 },
                 2});
  all.push_back({"Gemm",
                 {{200, 24}},
                 [](Graph& g) {
                   g.constant("w", {10, 24}, random_floats(240, 1));
                   g.constant("b", {10}, random_floats(10, 2));
                   g.node("Gemm", {"x", "w", "b"}, {"out"}, {Graph::integer("transB", 1)});
                 },
                 2});
  all.push_back({"MatMulConstantAndAdd",
                 {{2, 130, 24}},
                 [](Graph& g) {
                   g.constant("w", {24, 9}, random_floats(216, 1));
                   g.constant("b", {9}, random_floats(9, 2));
                   g.node("MatMul", {"x", "w"}, {"p"});
                   g.node("Add", {"b", "p"}, {"out"});
                 },
                 3});
  all.push_back(
      {"MatMulBatched", {{2, 3, 150, 20}, {3, 20, 70}}, [](Graph& g) { g.node("MatMul", {"x", "y"}, {"out"}); }, 4});
  all.push_back({"MatMulTransposed",
                 {{150, 20}, {70, 20}},
                 [](Graph& g) {
                   g.node("Transpose", {"y"}, {"t"});
                   g.node("MatMul", {"x", "t"}, {"out"});
                 },
                 2});
  for (const std::string equation : {"bhid,bhjd->bhij", "bhji, bhjd -> hbid"}) {
    const bool scores = equation[3] == 'd';
    all.push_back({scores ? "EinsumScores" : "EinsumTurned",
                   {{2, 3, 30, 16}, scores ? Shape{2, 3, 40, 16} : Shape{2, 3, 30, 20}},
                   [=](Graph& g) { g.node("Einsum", {"x", "y"}, {"out"}, {Graph::text("equation", equation)}); },
                   4});
  }
  all.push_back({"Attention",
                 {{2, 150, 16}, {2, 16, 77}, {2, 77, 24}},
                 [](Graph& g) {
                   g.constant("scale", {}, std::vector<float>{0.25F});
                   g.node("Mul", {"x", "scale"}, {"queries"});
                   g.node("MatMul", {"queries", "y"}, {"scores"});
                   g.node("Softmax", {"scores"}, {"weights"}, {Graph::integer("axis", 2)});
                   g.node("MatMul", {"weights", "z"}, {"out"});
                 },
                 3});
  all.push_back({"Gelu",
                 {{30, 33}},
                 [](Graph& g) {
                   g.constant("root", {}, std::vector<float>{1.41421354F});
                   g.constant("one", {}, std::vector<float>{1.0F});
                   g.constant("half", {}, std::vector<float>{0.5F});
                   g.node("Div", {"x", "root"}, {"a"});
                   g.node("Erf", {"a"}, {"b"});
                   g.node("Add", {"b", "one"}, {"c"});
                   g.node("Mul", {"x", "c"}, {"d"});
                   g.node("Mul", {"d", "half"}, {"out"});
                 },
                 2});
  all.push_back({"LayerNormalization",
                 {{5, 50}},
                 [](Graph& g) {
                   g.constant("w", {50}, random_floats(50, 1));
                   g.constant("b", {50}, random_floats(50, 2));
                   g.node("LayerNormalization", {"x", "w", "b"}, {"out"}, {Graph::integer("axis", -1)});
                 },
                 2});
  all.push_back({"InstanceNormalization",
                 {{2, 3, 8, 9}},
                 [](Graph& g) {
                   g.constant("w", {3}, random_floats(3, 1));
                   g.constant("b", {3}, random_floats(3, 2));
                   g.node("InstanceNormalization", {"x", "w", "b"}, {"out"});
                 },
                 4});
  all.push_back({"GridSample",
                 {{2, 5, 8, 9}, {2, 3, 4, 2}},
                 [](Graph& g) { g.node("GridSample", {"x", "y"}, {"out"}, {Graph::integer("align_corners", 1)}); },
                 4});
  all.push_back({"GridSampleEdges",
                 {{1, 5, 8, 9}, {1, 30, 4, 2}},
                 [](Graph& g) { g.node("GridSample", {"x", "y"}, {"out"}, {Graph::text("mode", "bilinear")}); },
                 4});
  all.push_back({"SpaceToDepth",
                 {{2, 3, 8, 12}},
                 [](Graph& g) { g.node("SpaceToDepth", {"x"}, {"out"}, {Graph::integer("blocksize", 4)}); },
                 4});
  all.push_back({"PixelUnshuffle",
                 {{2, 3, 8, 12}},
                 [](Graph& g) {
                   g.constant("three", {1}, Ints{3});
                   g.constant("rows", {5}, Ints{0, 0, -1, 4, 0});
                   g.constant("columns", {6}, Ints{0, 0, 0, 0, -1, 4});
                   g.constant("merged", {6}, Ints{0, -1, 1, 1, 0, 0});
                   g.constant("two_three", {2}, Ints{2, 3});
                   g.node("Unsqueeze", {"x", "three"}, {"a"});
                   g.node("Reshape", {"a", "rows"}, {"b"});
                   g.node("Reshape", {"b", "columns"}, {"c"});
                   g.node("Transpose", {"c"}, {"d"}, {Graph::integers("perm", {0, 1, 3, 5, 2, 4})});
                   g.node("Reshape", {"d", "merged"}, {"e"});
                   g.node("Squeeze", {"e", "two_three"}, {"out"});
                 },
                 4});
  all.push_back({"ConcatAndSplit",
                 {{2, 3, 4}, {2, 5, 4}},
                 [](Graph& g) {
                   g.constant("sizes", {2}, Ints{6, 2});
                   g.node("Concat", {"x", "y"}, {"all"}, {Graph::integer("axis", 1)});
                   g.node("Split", {"all", "sizes"}, {"first", "second"}, {Graph::integer("axis", 1)});
                   g.node("Concat", {"second", "first"}, {"out"}, {Graph::integer("axis", -2)});
                 },
                 3});
  all.push_back({"ReshapesOfViews",
                 {{2, 6, 4}},
                 [](Graph& g) {
                   g.constant("split", {4}, Ints{0, 2, 3, -1});
                   g.constant("merged", {2}, Ints{-1, 4});
                   g.node("Reshape", {"x", "split"}, {"a"});
                   g.node("Transpose", {"a"}, {"b"}, {Graph::integers("perm", {2, 0, 1, 3})});
                   g.node("Reshape", {"b", "merged"}, {"c"});
                   g.node("Flatten", {"c"}, {"d"}, {Graph::integer("axis", 1)});
                   g.node("Transpose", {"d"}, {"out"});
                 },
                 2});
  all.push_back({"ShapeArithmetic",
                 {{2, 6, 4}},
                 [](Graph& g) {
                   g.constant("index", {1}, Ints{1});
                   g.constant("minus", {1}, Ints{-1});
                   g.node("Shape", {"x"}, {"shape"});
                   g.node("Gather", {"shape", "index"}, {"six"});
                   g.node("Concat", {"six", "minus"}, {"wanted"}, {Graph::integer("axis", 0)});
                   g.node("Reshape", {"x", "wanted"}, {"out"});
                 },
                 2});
  all.push_back({"GatherRows",
                 {{5, 6}},
                 [](Graph& g) {
                   g.constant("index", {2, 2}, Ints{4, 0, -1, 2});
                   g.node("Gather", {"x", "index"}, {"out"}, {Graph::integer("axis", 1)});
                 },
                 3});
  all.push_back({"GatherElements",
                 {{3, 4}},
                 [](Graph& g) {
                   g.constant("index", {2, 4}, Ints{0, 1, 2, 0, 2, 2, 1, -1});
                   g.node("GatherElements", {"x", "index"}, {"out"}, {Graph::integer("axis", 0)});
                 },
                 2});
  all.push_back({"GatherND",
                 {{3, 4, 2}},
                 [](Graph& g) {
                   g.constant("index", {3, 2}, Ints{0, 1, 2, 3, -1, 0});
                   g.node("GatherND", {"x", "index"}, {"out"});
                 },
                 2});
  all.push_back({"ScatterND",
                 {{3, 4}},
                 [](Graph& g) {
                   g.constant("index", {2, 1}, Ints{2, 0});
                   g.constant("updates", {2, 4}, random_floats(8, 1));
                   g.node("ScatterND", {"x", "index", "updates"}, {"out"});
                 },
                 2});
  all.push_back({"NonZero",
                 {{6, 7}},
                 [](Graph& g) {
                   g.node("Relu", {"x"}, {"positive"});
                   g.node("NonZero", {"positive"}, {"out"});
                 },
                 2,
                 true});
  all.push_back({"Range",
                 {{1, 9}},
                 [](Graph& g) {
                   g.constant("one", {}, Ints{1});
                   g.constant("two", {}, Ints{2});
                   g.node("Shape", {"x"}, {"shape"});
                   g.node("Gather", {"shape", "one"}, {"nine"});
                   g.node("Range", {"one", "nine", "two"}, {"out"});
                 },
                 1,
                 true});
  all.push_back({"ExpandAndFill",
                 {{3, 1}},
                 [](Graph& g) {
                   g.constant("wanted", {3}, Ints{2, 1, 4});
                   g.constant("size", {2}, Ints{3, 4});
                   g.node("Expand", {"x", "wanted"}, {"wide"});
                   g.node("ConstantOfShape", {"size"}, {"fill"}, {Graph::tensor("value", {1}, {5})});
                   g.node("Cast", {"fill"}, {"five"}, {Graph::integer("to", 1)});
                   g.node("Add", {"wide", "five"}, {"out"});
                 },
                 3});
  all.push_back({"IntegersOfFloats",
                 {{3, 5}},
                 [](Graph& g) {
                   g.constant("two", {}, Ints{2});
                   g.node("Cast", {"x"}, {"whole"}, {Graph::integer("to", 7)});
                   g.node("Mul", {"whole", "two"}, {"twice"});
                   g.node("Neg", {"twice"}, {"out"});
                 },
                 2,
                 true});
  return all;
}

Tensor run_network(const Case& one, bool bf16, int threads = 1) {
  std::string why_not;
  const auto network = Network::build(parse_onnx(one.bytes(), one.name), one.name, {threads, bf16}, why_not);
  EXPECT_EQ(why_not, "");
  return network ? network->run(one.input_names(), one.random_inputs(), {"out"}).at(0) : Tensor();
}

Tensor run_onnx_runtime(const Case& one) {
  const std::string bytes = one.bytes();
  OnnxSession session(std::string_view(bytes), one.name, 1);
  return session.run(one.input_names(), one.random_inputs(), {"out"}).at(0);
}

/// Every difference within so much of the largest value.
void expect_near(const Tensor& a, const Tensor& b, float tolerance) {
  EXPECT_EQ(a.shape, b.shape);
  EXPECT_EQ(a.integers, b.integers);
  ASSERT_EQ(a.floats.size(), b.floats.size());
  float size = 0.1F, worst = 0.0F;
  for (std::size_t i = 0; i < a.floats.size(); ++i) {
    size = std::max(size, std::abs(b.floats[i]));
    worst = std::max(worst, std::abs(a.floats[i] - b.floats[i]));
  }
  EXPECT_LE(worst, tolerance * size);
}

TEST(EveryOperator, GivesInFloatWhatOnnxRuntimeGives) {
  for (const Case& one : cases()) {
    SCOPED_TRACE(one.name);
    expect_near(run_network(one, false), run_onnx_runtime(one), 1e-5F);
  }
}

TEST(EveryOperator, GivesInBfloat16NearlyTheSame) {
  if (!nn::has_native_bf16()) GTEST_SKIP() << "no native bfloat16 here";
  for (const Case& one : cases()) {
    SCOPED_TRACE(one.name);
    expect_near(run_network(one, true), run_network(one, false), 0.01F);
  }
}

TEST(EveryOperator, GivesTheSameBytesOnAnyNumberOfThreads) {
  for (const Case& one : cases()) {
    SCOPED_TRACE(one.name);
    const bool bf16 = nn::has_native_bf16();
    const Tensor single = run_network(one, bf16, 1), four = run_network(one, bf16, 4);
    EXPECT_EQ(single.floats, four.floats);
    EXPECT_EQ(single.integers, four.integers);
  }
}

}  // namespace
}  // namespace demslam
