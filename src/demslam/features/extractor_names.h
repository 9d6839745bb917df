#pragma once

#include <string>
#include <vector>

namespace demslam {

/// What FrontendOptions::extractor may be.
std::vector<std::string> extractor_names();

}  // namespace demslam
