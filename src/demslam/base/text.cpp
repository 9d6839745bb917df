#include "demslam/base/text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>

#include "demslam/base/error.h"

namespace demslam {
namespace {

constexpr std::string_view kBlanks = " \t\r";

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

std::vector<std::string> split_at_commas(std::string_view line) {
  std::vector<std::string> fields;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    fields.emplace_back(trimmed(line.substr(begin, end - begin)));
    begin = end + 1;
  }
  return fields;
}

std::vector<std::string> split_at_blanks(std::string_view line) {
  std::vector<std::string> fields;
  for (std::size_t begin = line.find_first_not_of(kBlanks); begin != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(kBlanks, begin), line.size());
    fields.emplace_back(line.substr(begin, end - begin));
    begin = line.find_first_not_of(kBlanks, end);
  }
  return fields;
}

template <class Number>
std::optional<Number> whole(std::string_view text) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// A decimal number taken apart: +-0.DIGITS * 10^exponent.
struct Decimal {
  bool negative = false;
  std::string digits;
  int exponent = 0;
};

std::optional<Decimal> parse_decimal(std::string_view text) {
  Decimal decimal;
  if (!text.empty() && (text.front() == '-' || text.front() == '+')) {
    decimal.negative = text.front() == '-';
    text.remove_prefix(1);
  }
  if (const std::size_t e = text.find_first_of("eE"); e != std::string_view::npos) {
    const auto exponent = whole<int>(text.substr(e + 1));
    if (!exponent || std::abs(*exponent) > 100) return std::nullopt;
    decimal.exponent = *exponent;
    text = text.substr(0, e);
  }
  const std::size_t point = std::min(text.find('.'), text.size());
  decimal.digits = std::string(text.substr(0, point));
  if (point < text.size()) decimal.digits += text.substr(point + 1);
  const bool all_digits = decimal.digits.find_first_not_of("0123456789") == std::string::npos;
  if (decimal.digits.empty() || !all_digits) return std::nullopt;
  decimal.exponent += static_cast<int>(point);
  return decimal;
}

}  // namespace

void TextTable::fail(const TextRow& row, const std::string& message) const {
  throw Error::at(source, row.line, message);
}

double TextTable::number(const TextRow& row, std::size_t column) const {
  if (column >= row.fields.size()) fail(row, "column " + std::to_string(column + 1) + " is missing");
  const auto value = whole<double>(row.fields[column]);
  if (!value || !std::isfinite(*value)) fail(row, "'" + row.fields[column] + "' is not a finite number");
  return *value;
}

std::int64_t TextTable::integer(const TextRow& row, std::size_t column) const {
  if (column >= row.fields.size()) fail(row, "column " + std::to_string(column + 1) + " is missing");
  const auto value = whole<std::int64_t>(row.fields[column]);
  if (!value) fail(row, "'" + row.fields[column] + "' is not an integer");
  return *value;
}

TextTable parse_table(std::string_view text, const std::string& source) {
  TextTable table{.source = source};
  int line_number = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string_view line = trimmed(text.substr(begin, end - begin));
    begin = end + 1;
    ++line_number;
    if (line.empty() || line.front() == '#' || line.front() == '%') continue;
    if (table.rows.empty()) table.commas = line.find(',') != std::string_view::npos;
    table.rows.push_back({line_number, table.commas ? split_at_commas(line) : split_at_blanks(line)});
  }
  return table;
}

TextTable read_table(const std::filesystem::path& file) { return parse_table(read_text(file), file.string()); }

std::string read_text(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream || std::filesystem::is_directory(file)) {
    throw Error(file.string() + ": cannot be read; check the path and its permissions");
  }
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

void write_text(const std::filesystem::path& file, std::string_view text) {
  std::ofstream stream(file, std::ios::binary | std::ios::trunc);
  stream.write(text.data(), static_cast<std::streamsize>(text.size()));
  stream.close();
  if (!stream)
    throw Error(file.string() + ": cannot be written; check the folder, its permissions and the disk's space");
}

std::optional<TimestampNs> seconds_to_ns(std::string_view decimal_seconds) {
  return scaled_integer(decimal_seconds, 9);
}

std::optional<std::int64_t> scaled_integer(std::string_view text, int power) {
  auto decimal = parse_decimal(text);
  if (!decimal) return std::nullopt;
  const int kept = decimal->exponent + power;  // digits in front of the result's point
  if (kept < 0) return 0;
  const bool round_up = static_cast<std::size_t>(kept) < decimal->digits.size() && decimal->digits[kept] >= '5';
  decimal->digits.resize(kept, '0');
  const auto magnitude = decimal->digits.empty() ? 0 : whole<std::int64_t>(decimal->digits);
  if (!magnitude || *magnitude == std::numeric_limits<std::int64_t>::max()) return std::nullopt;
  const std::int64_t rounded = *magnitude + (round_up ? 1 : 0);
  return decimal->negative ? -rounded : rounded;
}

std::string seconds_text(TimestampNs t_ns) {
  const bool negative = t_ns < 0;
  const std::uint64_t magnitude = negative ? 0 - static_cast<std::uint64_t>(t_ns) : static_cast<std::uint64_t>(t_ns);
  std::string text = std::to_string(magnitude);
  if (text.size() < 10) text.insert(0, 10 - text.size(), '0');
  text.insert(text.size() - 9, 1, '.');
  return (negative ? "-" : "") + text;
}

}  // namespace demslam
