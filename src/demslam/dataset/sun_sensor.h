#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <vector>

#include "demslam/base/time.h"

namespace demslam {

/// Unit vectors towards the sun: as measured in the body and, where the file says it, as an ephemeris has it in the
/// map.
struct SunMeasurement {
  TimestampNs t_ns = 0;
  Eigen::Vector3d sun_body = Eigen::Vector3d::UnitX();
  double sigma_deg = 0.5;  ///< per axis across the direction
  std::optional<Eigen::Vector3d> sun_map = std::nullopt;
};

/// sun.csv: lines `t [ns], x, y, z in the body, sigma [deg]`, and optionally `x, y, z in the map`; stamps increasing,
/// directions of any length above zero. Throws Error with the line.
std::vector<SunMeasurement> read_sun(const std::filesystem::path& file);

}  // namespace demslam
