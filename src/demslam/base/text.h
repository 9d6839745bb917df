#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "demslam/base/time.h"

namespace demslam {

/// One line of a text table: its number in the file, from 1, and its fields, trimmed.
struct TextRow {
  int line = 0;
  std::vector<std::string> fields;
};

/// A table as plain text: fields parted by commas (then a field may be empty or hold blanks) or else by blanks.
struct TextTable {
  std::string source;  ///< the file's name, for messages
  bool commas = false;
  std::vector<TextRow> rows;  ///< without blank lines and lines that begin with '#' or '%'

  /// Field `column` as a finite number. Throws Error with file and line when it is missing or no number.
  double number(const TextRow& row, std::size_t column) const;
  /// Field `column` as an integer, exactly.
  std::int64_t integer(const TextRow& row, std::size_t column) const;
  [[noreturn]] void fail(const TextRow& row, const std::string& message) const;
};

/// Reads a table. Throws Error when the file cannot be read.
TextTable read_table(const std::filesystem::path& file);
TextTable parse_table(std::string_view text, const std::string& source);

/// Reads a whole file. Throws Error when it cannot be read.
std::string read_text(const std::filesystem::path& file);

/// Writes a whole file. Throws Error when the folder is missing or not writable or the disk is full.
void write_text(const std::filesystem::path& file, std::string_view text);

/// Decimal seconds ("1403715529.112143517", "1.403715529112143517e+09") as nanoseconds, without a detour through
/// floating point; digits beyond the ninth decimal are rounded. Nothing when the text is no number or does not fit.
std::optional<TimestampNs> seconds_to_ns(std::string_view decimal_seconds);

/// A decimal number times 10^`power` as an integer, rounded half away from zero; seconds_to_ns() with another power.
std::optional<std::int64_t> scaled_integer(std::string_view decimal, int power);

/// Nanoseconds as decimal seconds with nine decimals, exactly.
std::string seconds_text(TimestampNs t_ns);

}  // namespace demslam
