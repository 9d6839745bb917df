#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace demslam {

/// Results of single runs on disk, FOLDER/runs/NAME.json, so that an interrupted experiment goes on where it stopped.
/// Inputs and results are JSON texts; a result of other inputs, or of another version, is not used again.
class FinishedRuns {
 public:
  /// Makes the folder. Throws Error when it cannot.
  explicit FinishedRuns(const std::filesystem::path& folder);

  std::optional<std::string> load(const std::string& name, const std::string& inputs) const;
  /// Whole or not at all.
  void save(const std::string& name, const std::string& inputs, const std::string& result) const;

 private:
  std::filesystem::path folder_;
};

}  // namespace demslam
