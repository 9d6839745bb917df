#pragma once

#include <filesystem>
#include <memory>

#include "demslam/dataset/image_sequence.h"
#include "demslam/dataset/sequence.h"

namespace demslam {

/// One dataset format: whether a path looks like it, and how to open it. `calibration` is empty or replaces the
/// dataset's.
struct DatasetReader {
  const char* format;
  const char* looks_like;  ///< for the message when nothing fits
  bool (*recognises)(const std::filesystem::path& path);
  std::unique_ptr<StereoSequence> (*open)(const std::filesystem::path& path, const std::filesystem::path& calibration);
};

extern const DatasetReader kDemslamReader, kLusnarReader, kS3liReader, kKittiReader, kEurocReader, kFoldersReader;

}  // namespace demslam
