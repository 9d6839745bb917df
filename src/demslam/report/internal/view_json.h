#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "demslam/report/internal/images.h"
#include "demslam/report/internal/run_map.h"

namespace demslam {

/// Keyframes with their images, evenly along the run, and what the map says of their features: [{"keyframe", "image",
/// "features": u16 of (u, v, disparity) in eighths of a pixel, "matches": u16 of (feature, u before, v before)}].
nlohmann::ordered_json views_json(const std::vector<KeyframePose>& keyframes, const MapStore* map,
                                  const RunDataset& dataset, const PageOptions& options, ImageTable& images);

}  // namespace demslam
