#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "commands.h"
#include "demslam/features/model_info.h"

namespace demslam::apps {
namespace {

std::string shape_text(const TensorInfo& tensor) {
  std::string text;
  for (const std::int64_t size : tensor.shape)
    text += (text.empty() ? "" : " x ") + (size < 0 ? "?" : std::to_string(size));
  return fmt::format("{} {} [{}]", tensor.name, tensor.type, text);
}

void check(const std::filesystem::path& file) {
  const ModelInfo info = inspect_model(file);
  fmt::print("{}: fits the contract '{}'\n  sha256   {}\n", file.string(), to_string(info.contract), info.sha256);
  if (info.descriptor_width > 0) fmt::print("  width    {}\n", info.descriptor_width);
  fmt::print("  licence  {}\n", info.card.licence.empty() ? "not stated (no card beside the file)" : info.card.licence);
  for (const TensorInfo& tensor : info.inputs) fmt::print("  input    {}\n", shape_text(tensor));
  for (const TensorInfo& tensor : info.outputs) fmt::print("  output   {}\n", shape_text(tensor));
}

}  // namespace

void add_models(CLI::App& app) {
  auto file = std::make_shared<std::filesystem::path>();
  CLI::App* models = app.add_subcommand("models", "learned feature extractors and matchers");
  models->require_subcommand(1);
  CLI::App* command = models->add_subcommand("check", "say what an ONNX file is, or why it cannot be used");
  command->add_option("file", *file, "ONNX graph; its card, if any, is <file>.toml")->required();
  command->footer("Example:\n  demslam models check xfeat.onnx");
  command->callback([file] { check(*file); });
}

}  // namespace demslam::apps
