#include "demslam/features/model_catalogue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "demslam/base/error.h"
#include "demslam/base/sha256.h"
#include "demslam/base/text.h"
#include "demslam/features/model_info.h"
#include "demslam/features/test_onnx.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

/// A graph of contract lightglue, as bytes.
std::string matcher_bytes() {
  test::OnnxGraph graph;
  for (const char* name : {"kpts0", "kpts1"}) graph.input(name, {1, -1, 2});
  for (const char* name : {"desc0", "desc1"}) graph.input(name, {1, -1, 256});
  graph.output("matches0", {1, 2}, std::vector<std::int64_t>{0, 0});
  graph.output("mscores0", {1}, std::vector<float>{1.0F});
  graph.save("graph.onnx");
  const std::string bytes = read_text("graph.onnx");
  fs::remove("graph.onnx");
  return bytes;
}

Download served(const std::string& bytes) {
  return [bytes](const std::string&) { return bytes; };
}

std::string message_of(const std::string& sha256, const std::string& bytes) {
  try {
    fetch_model(known_model("lightglue"), ".", sha256, served(bytes));
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

bool kept() { return fs::exists("superpoint_lightglue_fused_cpu.onnx"); }

TEST(FetchedModel, IsKeptWithItsCardWhenTheHashIsTheOneGiven) {
  const std::string bytes = matcher_bytes();
  const fs::path file = fetch_model(known_model("lightglue"), ".", sha256_of(bytes), served(bytes));
  const ModelInfo info = inspect_model(file);
  EXPECT_EQ(info.card.sha256, sha256_of(bytes));
  EXPECT_EQ(info.card.licence, "Apache-2.0");
  EXPECT_EQ(info.contract, Contract::lightglue);
  fs::remove(file);
}

TEST(FetchedModel, IsNotKeptWithoutAHashAndTheMessageHasIt) {
  const std::string bytes = matcher_bytes();
  EXPECT_THAT(message_of("", bytes), testing::HasSubstr("pass --sha256 " + sha256_of(bytes)));
  EXPECT_FALSE(kept());
}

TEST(FetchedModel, IsRefusedWithAnotherHashOrWithoutAContract) {
  EXPECT_THAT(message_of(std::string(64, '0'), matcher_bytes()), testing::HasSubstr("nothing was kept"));
  EXPECT_THAT(message_of(sha256_of("a web page"), "a web page"), testing::HasSubstr("not a usable ONNX model"));
  EXPECT_FALSE(kept());
}

TEST(ModelCatalogue, RefusesNamesItDoesNotKnowAndListsThoseItDoes) {
  try {
    known_model("orb");
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("superpoint, lightglue"));
  }
}

TEST(Download, SaysInOneLineThatAServerCannotBeReached) {
  try {
    download("http://127.0.0.1:1/model.onnx");
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("cannot be reached"));
    EXPECT_THAT(error.what(), testing::Not(testing::HasSubstr("\n")));
  }
}

}  // namespace
}  // namespace demslam
