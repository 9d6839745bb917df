#pragma once

#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace demslam::testing_support {

namespace fs = std::filesystem;

/// What the program printed and how it ended.
struct Outcome {
  int status = 0;
  std::string out, err;

  /// One line on stderr that starts as every error of the program does.
  bool is_one_line_error() const {
    return status == 1 && err.rfind("demslam: error: ", 0) == 0 && err.find('\n') == err.size() - 1;
  }
};

inline std::string read_text(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

inline void write_text(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
}

/// Runs `prefix demslam arguments` in a shell; `folder` takes its output.
inline Outcome run_program(const std::string& arguments, const fs::path& folder, const std::string& prefix = "") {
  fs::create_directories(folder);
  const std::string command = prefix + " '" DEMSLAM_PROGRAM "' " + arguments + " >'" + (folder / "out.txt").string() +
                              "' 2>'" + (folder / "err.txt").string() + "' </dev/null";
  const int raw = std::system(command.c_str());
  return {WIFEXITED(raw) ? WEXITSTATUS(raw) : -1, read_text(folder / "out.txt"), read_text(folder / "err.txt")};
}

}  // namespace demslam::testing_support
