#pragma once

#include <string>

#include "demslam/slam/backend.h"

namespace demslam {

std::string to_string(LoopStatus status);

/// The frame's line of frames.jsonl, without its end.
std::string frame_json(const FrameRecord& record);

}  // namespace demslam
