#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "demslam/geometry/pose.h"

namespace demslam {

/// A place in a YAML file that somebody else wrote (EuRoC, Kalibr, OpenCV): values by key, errors with file and line.
/// Takes OpenCV's dialect too ("%YAML:1.0", "!!opencv-matrix").
class Yaml {
 public:
  static Yaml from_file(const std::filesystem::path& file);
  static Yaml from_text(const std::string& text, const std::string& source);
  ~Yaml();
  Yaml(Yaml&&) noexcept;

  bool has(const std::string& key) const;
  Yaml operator[](const std::string& key) const;  ///< throws Error when the key is missing

  double number() const;
  std::string text() const;
  /// A flat list, the rows of a nested one in sequence, or the list under `data` of an OpenCV matrix.
  std::vector<double> numbers() const;
  /// A 4x4 matrix as numbers() reads it. Refused when it is no rigid transform.
  Pose pose() const;

  [[noreturn]] void fail(const std::string& message) const;

 private:
  struct Node;
  explicit Yaml(std::unique_ptr<Node> node);
  std::unique_ptr<Node> node_;
};

}  // namespace demslam
