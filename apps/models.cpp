#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>

#include "commands.h"
#include "demslam/base/error.h"
#include "demslam/features/model_catalogue.h"
#include "demslam/features/model_info.h"

namespace demslam::apps {
namespace {

struct Arguments {
  std::string name, sha256;
  std::filesystem::path folder = ".";
  bool accept_licence = false;
};

std::string shape_text(const TensorInfo& tensor) {
  std::string text;
  for (const std::int64_t size : tensor.shape)
    text += (text.empty() ? "" : " x ") + (size < 0 ? "?" : std::to_string(size));
  return fmt::format("{} {} [{}]", tensor.name, tensor.type, text);
}

void check(const std::string& name) {
  const auto built_in = built_in_model_names();
  const bool is_built_in = std::ranges::find(built_in, name) != built_in.end();
  const ModelInfo info = is_built_in ? inspect_built_in_model(name) : inspect_model(name);
  fmt::print("{}: fits the contract '{}'\n  sha256   {}\n", info.file.string(), to_string(info.contract), info.sha256);
  if (info.descriptor_width > 0) fmt::print("  width    {}\n", info.descriptor_width);
  fmt::print("  licence  {}\n", info.card.licence.empty() ? "not stated (no card beside the file)" : info.card.licence);
  fmt::print("  backend  {}{}\n", info.backend, info.fallback.empty() ? "" : " (not oneDNN: " + info.fallback + ")");
  for (const TensorInfo& tensor : info.inputs) fmt::print("  input    {}\n", shape_text(tensor));
  for (const TensorInfo& tensor : info.outputs) fmt::print("  output   {}\n", shape_text(tensor));
}

void list() {
  for (const std::string& name : built_in_model_names()) {
    const ModelInfo model = inspect_built_in_model(name);
    fmt::print("{}: {}, built in\n  licence  {}\n  sha256   {}\n", name,
               model.contract == Contract::lightglue ? "matcher" : "extractor", model.card.licence, model.sha256);
  }
  for (const KnownModel& model : known_models()) {
    fmt::print("{}: {}, to be fetched\n  licence  {}\n  from     {}\n  sha256   {}\n", model.name, model.role,
               model.licence, model.url, model.sha256.empty() ? "not known: give it with --sha256" : model.sha256);
  }
}

void fetch(const Arguments& a) {
  const KnownModel& model = known_model(a.name);
  fmt::print("{}: licence: {}\n", model.name, model.licence);
  if (!a.accept_licence) throw Error(model.name + ": pass --accept-licence if this licence allows your use");
  const std::filesystem::path file = fetch_model(model, a.folder, a.sha256);
  fmt::print("{}: kept, with its card\n", file.string());
}

void add_fetch(CLI::App& models) {
  auto a = std::make_shared<Arguments>();
  CLI::App* command = models.add_subcommand("fetch", "download a published model, check it and write its card");
  command->add_option("name", a->name, "as 'demslam models list' has it")->required();
  command->add_option("-o,--output", a->folder, "folder to put it in")->check(CLI::ExistingDirectory);
  command->add_option("--sha256", a->sha256, "the SHA-256 that you have checked; without it the file's is shown");
  command->add_flag("--accept-licence", a->accept_licence, "the licence allows your use");
  command->footer("Example:\n  demslam models fetch lightglue --accept-licence");
  command->callback([a] { fetch(*a); });
}

}  // namespace

void add_models(CLI::App& app) {
  CLI::App* models = app.add_subcommand("models", "learned feature extractors and matchers");
  models->require_subcommand(1);
  models->add_subcommand("list", "what is built in and what can be fetched")->callback(list);
  add_fetch(*models);
  auto file = std::make_shared<std::string>();
  CLI::App* command = models->add_subcommand("check", "say what an ONNX file is, or why it cannot be used");
  command
      ->add_option("file", *file,
                   "ONNX graph; its card, if any, is <file>.toml; or lunar or lunar-matcher, which are built in")
      ->required();
  command->footer("Example:\n  demslam models check xfeat.onnx");
  command->callback([file] { check(*file); });
}

}  // namespace demslam::apps
