#include "demslam/experiment/finished_runs.h"

#include <nlohmann/json.hpp>

#include "demslam/base/error.h"
#include "demslam/base/text.h"
#include "demslam/base/version.h"

namespace demslam {
namespace {

using Json = nlohmann::ordered_json;

}  // namespace

FinishedRuns::FinishedRuns(const std::filesystem::path& folder) : folder_(folder / "runs") {
  std::error_code failure;
  std::filesystem::create_directories(folder_, failure);
  if (failure) throw Error(folder_.string() + ": cannot be made: " + failure.message());
}

std::optional<std::string> FinishedRuns::load(const std::string& name, const std::string& inputs) const {
  const auto file = folder_ / (name + ".json");
  if (!std::filesystem::exists(file)) return std::nullopt;
  const Json json = Json::parse(read_text(file), nullptr, false);
  if (json.is_discarded() || json.value("demslam", "") != kVersion ||
      json.value("inputs", Json()) != Json::parse(inputs))
    return std::nullopt;
  return json.at("result").dump();
}

void FinishedRuns::save(const std::string& name, const std::string& inputs, const std::string& result) const {
  const Json json = {{"demslam", kVersion}, {"inputs", Json::parse(inputs)}, {"result", Json::parse(result)}};
  const auto file = folder_ / (name + ".json");
  write_text(file.string() + ".part", json.dump(1) + "\n");
  std::filesystem::rename(file.string() + ".part", file);
}

}  // namespace demslam
