#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "demslam/geometry/pose.h"

namespace demslam {

/// Strict reading of one TOML table. `field` and `section` take a value when the key is there and leave the default
/// when it is not; `reject_unknown` then refuses every key nobody asked for, with its line and the nearest known name.
/// The same calls on a TomlWriter write the values out, so that a structure names its fields once.
/// Every error is an Error with file and line. Reads options, calibrations, scenes and model cards alike.
class TomlReader {
 public:
  static TomlReader from_file(const std::filesystem::path& file);
  static TomlReader from_text(const std::string& text, const std::string& source);
  ~TomlReader();
  TomlReader(TomlReader&&) noexcept;
  TomlReader& operator=(TomlReader&&) noexcept;

  static constexpr bool kReads = true;

  bool has(std::string_view key) const;
  /// Throws Error when `key` is missing.
  void require(std::string_view key) const;

  void field(std::string_view key, double& value);  ///< an integer is taken as a number; NaN and infinity are refused
  void field(std::string_view key, int& value);
  void field(std::string_view key, std::uint64_t& value);
  void field(std::string_view key, bool& value);
  void field(std::string_view key, std::string& value);
  void field(std::string_view key, std::filesystem::path& value);
  void field(std::string_view key, std::vector<double>& value);
  void field(std::string_view key, std::vector<std::string>& value);
  void field(std::string_view key, Eigen::Vector2d& value);
  void field(std::string_view key, Eigen::Vector3d& value);
  void field(std::string_view key, std::vector<Eigen::Vector2d>& value);  ///< [[x, y], ...]
  void field(std::string_view key, std::vector<Eigen::Vector3d>& value);  ///< [[x, y, z], ...]
  /// A pose as 16 numbers, row-major 4x4; refused when it is no rigid transform.
  void field(std::string_view key, Pose& value);

  /// Calls `body` with the sub-table `key` if it is there, then rejects the keys that body did not read.
  void section(std::string_view key, const std::function<void(TomlReader&)>& body);
  /// Calls `body` for each table of the array of tables [[key]].
  void sections(std::string_view key, const std::function<void(TomlReader&)>& body);

  void reject_unknown() const;
  /// An Error that points at `key` (or at the table when it is not there), for checks of the caller's own.
  [[noreturn]] void fail(std::string_view key, const std::string& message) const;

 private:
  struct Node;
  template <class Vector>
  void points(std::string_view key, std::vector<Vector>& value, const char* shape);
  explicit TomlReader(std::unique_ptr<Node> node);
  std::unique_ptr<Node> node_;
};

/// Writes fields in the order of the calls; the text reads back to the same values (shortest round-trip numbers).
class TomlWriter {
 public:
  static constexpr bool kReads = false;

  void field(std::string_view key, double value);
  void field(std::string_view key, int value);
  void field(std::string_view key, std::uint64_t value);
  void field(std::string_view key, bool value);
  void field(std::string_view key, const std::string& value);
  void field(std::string_view key, const std::filesystem::path& value);
  void field(std::string_view key, const std::vector<double>& value);
  void field(std::string_view key, const std::vector<std::string>& value);
  void field(std::string_view key, const Eigen::Vector2d& value);
  void field(std::string_view key, const Eigen::Vector3d& value);
  void field(std::string_view key, const std::vector<Eigen::Vector2d>& value);
  void field(std::string_view key, const std::vector<Eigen::Vector3d>& value);
  void field(std::string_view key, const Pose& value);
  void section(std::string_view key, const std::function<void(TomlWriter&)>& body);
  void comment(std::string_view line);

  const std::string& text() const { return text_; }

 private:
  void line(std::string_view key, const std::string& value);

  std::string text_;
  std::string prefix_;  ///< dotted name of the open section, with a trailing dot
};

}  // namespace demslam
