#pragma once

#include <filesystem>
#include <memory>

#include "demslam/dataset/sequence.h"

namespace demslam {

/// Whether a folder is a simulated dataset without its images (`demslam simulate --no-images`).
bool is_rendered_dataset(const std::filesystem::path& path);

/// Opens such a folder: every pair is rendered from its scene.toml when it is asked for, and equals byte for byte the
/// one that `simulate` would have written. Memory does not grow with the frames read; one pair is rendered at a time,
/// whoever asks. Throws Error as open_dataset() does, and when the scene cannot be made any more (its DEM is gone).
std::unique_ptr<StereoSequence> open_rendered_dataset(const std::filesystem::path& path,
                                                      const std::filesystem::path& calibration = {});

}  // namespace demslam
