#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "demslam/report/columns.h"

namespace demslam {

std::string base64(std::string_view bytes);

/// Arrays as the page reads them: {"f32": "..."} or {"u16": "..."}, base64 of little-endian numbers.
nlohmann::ordered_json packed(std::span<const float> values);
nlohmann::ordered_json packed(std::span<const std::uint16_t> values);
/// {"distance_m": {"f32": ...}, ...}
nlohmann::ordered_json packed(const Columns& columns);

}  // namespace demslam
