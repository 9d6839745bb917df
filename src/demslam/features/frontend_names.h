#pragma once

#include <string>
#include <vector>

namespace demslam {

/// What FrontendOptions::extractor and FrontendOptions::matcher may be.
std::vector<std::string> extractor_names();
std::vector<std::string> matcher_names();
/// What FrontendOptions::inference may be.
std::vector<std::string> inference_names();

}  // namespace demslam
