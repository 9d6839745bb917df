#pragma once

#include <numbers>

namespace demslam {

inline constexpr double kRadPerDeg = std::numbers::pi / 180.0;

}  // namespace demslam
