#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "demslam/dataset/sequence.h"

namespace demslam {

struct StereoFiles {
  TimestampNs t_ns = 0;
  std::filesystem::path left, right;
};

/// Everything a reader of image files finds out about a dataset; the sequence itself is the same for all of them.
struct ImageDataset {
  std::string format;
  std::filesystem::path path;
  StereoRig rig;
  std::vector<StereoFiles> pairs;
  std::size_t unpaired = 0;
  std::optional<std::filesystem::path> dem_file;
  std::optional<StartPose> start;
  std::vector<std::filesystem::path> definition_files;
};

/// Checks what every dataset must fulfil (not empty, stamps that increase) and makes it a sequence. Throws Error.
std::unique_ptr<StereoSequence> make_sequence(ImageDataset dataset);

/// The image files of a folder in natural order (frame2 before frame10). Throws Error when the folder is missing.
std::vector<std::filesystem::path> image_files(const std::filesystem::path& folder);

/// "image2.png" comes before "image10.png".
bool natural_less(const std::string& a, const std::string& b);

/// Pairs the images of two folders: by name where the cameras share names (then each image must have its partner), else
/// by order (then the counts must agree). Stamps are left at zero. Throws Error naming the first image without a
/// partner.
std::vector<StereoFiles> pair_images(const std::filesystem::path& left_folder,
                                     const std::filesystem::path& right_folder);

/// Stamps from a `times.txt` (decimal seconds, one line per pair) if `file` exists, else index / frame_rate_hz.
void stamp_pairs(std::vector<StereoFiles>& pairs, const std::filesystem::path& times_file, double frame_rate_hz);

/// Stamps from the left images' names, integer nanoseconds ("1403715273262142976.png").
void stamp_pairs_by_name(std::vector<StereoFiles>& pairs);

}  // namespace demslam
