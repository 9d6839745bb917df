#include "demslam/features/model_catalogue.h"

#include <algorithm>

#include "demslam/base/error.h"
#include "demslam/base/sha256.h"
#include "demslam/base/text.h"
#include "demslam/features/model_info.h"

#include <httplib.h>  // behind Eigen, whose names its system headers define as macros

namespace demslam {
namespace {

namespace fs = std::filesystem;

std::string file_name(const std::string& url) { return url.substr(url.rfind('/') + 1); }

void check_hash(const KnownModel& model, const std::string& found, const std::string& given) {
  const std::string& wanted = given.empty() ? model.sha256 : given;
  if (found == wanted) return;
  if (wanted.empty()) {
    throw Error(model.url + ": no SHA-256 is known for it; the file's is " + found +
                ": compare it with a source you trust, then pass --sha256 " + found);
  }
  throw Error(model.url + ": SHA-256 is " + found + ", not " + wanted + "; nothing was kept");
}

std::string card_text(const KnownModel& model, const ModelInfo& info) {
  return "name = \"" + model.name + "\"\ncontract = \"" + to_string(info.contract) + "\"\nlicence = \"" +
         model.licence + "\"\nsha256 = \"" + info.sha256 + "\"\n";
}

/// What `file` is; a file that fits no contract is removed.
ModelInfo inspect_or_remove(const fs::path& file) {
  try {
    return inspect_model(file);
  } catch (const Error&) {
    fs::remove(file);
    throw;
  }
}

}  // namespace

const std::vector<KnownModel>& known_models() {
  static const std::string release = "https://github.com/fabio-sim/LightGlue-ONNX/releases/download/v1.0.0/";
  static const std::vector<KnownModel> all{
      {"superpoint", "extractor", release + "superpoint.onnx",
       "Magic Leap: academic or non-profit non-commercial research only, no redistribution", ""},
      {"lightglue", "matcher for superpoint", release + "superpoint_lightglue_fused_cpu.onnx", "Apache-2.0", ""},
  };
  return all;
}

const KnownModel& known_model(const std::string& name) {
  const auto known = std::ranges::find(known_models(), name, &KnownModel::name);
  if (known != known_models().end()) return *known;
  std::string names;
  for (const KnownModel& model : known_models()) names += (names.empty() ? "" : ", ") + model.name;
  throw Error("no model '" + name + "' can be fetched; there are: " + names);
}

std::string download(const std::string& url) {
  const std::size_t path = url.find('/', url.find("//") + 2);
  httplib::Client client(url.substr(0, path));
  client.set_follow_location(true);
  client.set_connection_timeout(10);
  const httplib::Result response = client.Get(url.substr(path));
  if (!response) {
    throw Error(url + ": cannot be reached (" + httplib::to_string(response.error()) +
                "); without a network, bring the file and say what it is with 'demslam models check'");
  }
  if (response->status != 200) throw Error(url + ": the server answers " + std::to_string(response->status));
  return response->body;
}

fs::path fetch_model(const KnownModel& model, const fs::path& folder, const std::string& sha256, const Download& get) {
  const std::string content = get(model.url);
  check_hash(model, sha256_of(content), sha256);
  const fs::path file = folder / file_name(model.url);
  fs::remove(file.string() + ".toml");  // the card of an earlier one
  write_text(file, content);
  write_text(file.string() + ".toml", card_text(model, inspect_or_remove(file)));
  return file;
}

}  // namespace demslam
