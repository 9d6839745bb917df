#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "demslam/experiment/frontend_experiment.h"

namespace demslam::apps {

/// Which front-ends an experiment compares.
class FrontendChoice {
 public:
  void add_options(CLI::App& command);
  bool has_xfeat() const { return !xfeat_.empty(); }
  /// Throws Error for a name that is not there.
  std::vector<NamedFrontend> frontends() const;

 private:
  int points_ = 1024;
  std::filesystem::path xfeat_, lighterglue_;
  std::vector<std::string> models_, names_;
};

}  // namespace demslam::apps
