#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "demslam/image/image.h"

namespace demslam::test {

/// A folder of the running test's own, empty at the start and removed at the end.
class TestFolder {
 public:
  TestFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "demslam.XXXXXX").string();
    path_ = mkdtemp(pattern.data());
  }
  ~TestFolder() { std::filesystem::remove_all(path_); }
  TestFolder(const TestFolder&) = delete;
  TestFolder& operator=(const TestFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

  std::filesystem::path text(const std::string& name, const std::string& content) const {
    const std::filesystem::path file = make_parent(name);
    std::ofstream(file, std::ios::binary) << content;
    return file;
  }
  std::filesystem::path image(const std::string& name, std::uint8_t grey, int width = 8, int height = 6) const {
    const std::filesystem::path file = make_parent(name);
    write_image(file, Image(width, height, grey));
    return file;
  }

 private:
  std::filesystem::path make_parent(const std::string& name) const {
    std::filesystem::create_directories((path_ / name).parent_path());
    return path_ / name;
  }

  std::filesystem::path path_;
};

/// A calibration for the 8x6 images above.
inline std::string small_calibration_toml() {
  return "baseline_m = 0.3\n[left]\nwidth = 8\nheight = 6\nfx = 4.0\nfy = 4.0\ncx = 3.5\ncy = 2.5\n";
}

}  // namespace demslam::test
