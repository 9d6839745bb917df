#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace demslam {

/// A published model that fits a contract, and where it is.
struct KnownModel {
  std::string name, role, url, licence;
  std::string sha256;  ///< empty: nobody states one that could be checked
};

const std::vector<KnownModel>& known_models();
/// Throws Error that lists what there is.
const KnownModel& known_model(const std::string& name);

/// The bytes at an address. Throws Error when it cannot be had.
using Download = std::function<std::string(const std::string& url)>;
/// By HTTP(S), following redirections.
std::string download(const std::string& url);

/// Downloads `model` into `folder`, checks its SHA-256 (`sha256`, or what the catalogue states) and its contract, and
/// writes its card beside it. Throws Error, and leaves nothing, when no hash is known (the message has the file's), it
/// is another one, or the file is no model of a known contract.
std::filesystem::path fetch_model(const KnownModel& model, const std::filesystem::path& folder,
                                  const std::string& sha256, const Download& get = download);

}  // namespace demslam
