#pragma once

#include <filesystem>

#include "demslam/image/image.h"

namespace demslam {

class Mission;

/// Pictures of a finished or never rendered dataset: frames that its folder holds are read, others rendered.
class MissionPictures {
 public:
  MissionPictures(Mission& mission, std::filesystem::path dataset) : mission_(mission), dataset_(std::move(dataset)) {}

  /// Twelve left images evenly along the route, and the route over the shaded ground, north up. PNG or JPEG.
  void write_contact_sheet(const std::filesystem::path& file);
  /// Ten seconds of left images, evenly along the route, as an animated GIF of 256 pixels' width.
  void write_video(const std::filesystem::path& file);

 private:
  /// The left image of a frame, box-averaged to about a width.
  Image shrunk_frame(std::size_t index, int width);

  Mission& mission_;
  std::filesystem::path dataset_;
};

}  // namespace demslam
