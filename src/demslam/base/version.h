#pragma once

namespace demslam {

inline constexpr const char* kVersion = "0.1.0";  ///< CMake's project version; pinned by a test

}  // namespace demslam
