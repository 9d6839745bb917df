#pragma once

#include <stdexcept>
#include <string>

namespace demslam {

/// A set-up, input or configuration error: one line that says what, where and what to do.
/// The only exception type the library throws on purpose; caught once, in apps/.
/// Expected events of a run (too few matches, a no-data cell, lost) are result states, not errors.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;

  /// An error at a place of a user's file: "scene.toml:12: message".
  static Error at(const std::string& file, int line, const std::string& message) {
    return Error(file + ":" + std::to_string(line) + ": " + message);
  }
};

}  // namespace demslam
