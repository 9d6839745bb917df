#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "demslam/base/error.h"

namespace demslam::apps {

inline void write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream stream(file, std::ios::binary | std::ios::trunc);
  stream << text;
  if (!stream.flush()) throw Error(file.string() + ": cannot be written (disk full, or the folder is not writable)");
}

}  // namespace demslam::apps
