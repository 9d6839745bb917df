#pragma once

#include <memory>
#include <string>

#include "demslam/base/progress.h"

namespace demslam::apps {

/// Draws "label  [#####.....]  120/300  8.1 frames/s  22 s left" on stderr; only on a terminal, and only after one
/// second. The Progress it hands out also carries the interrupt token.
class ProgressBar {
 public:
  ProgressBar(std::string label, std::string unit);
  ~ProgressBar();  ///< ends the line
  Progress progress();

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace demslam::apps
