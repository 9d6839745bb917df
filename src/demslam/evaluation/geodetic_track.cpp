#include "demslam/evaluation/geodetic_track.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <chrono>
#include <cmath>
#include <fstream>
#include <initializer_list>
#include <optional>

#include "demslam/base/error.h"
#include "demslam/base/text.h"

namespace demslam {
namespace {

constexpr std::size_t kColumns = 6;  // date, time, latitude, longitude, height, Q; what follows is not needed

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(separator, begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

std::optional<int> integer(const std::string& text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// "2021/07/07" and "12:34:50.200".
std::optional<TimestampNs> calendar_ns(const std::string& date, const std::string& time) {
  using namespace std::chrono;
  const auto days = split(date, '/'), clock = split(time, ':');
  if (days.size() != 3 || clock.size() != 3) return std::nullopt;
  const auto y = integer(days[0]), m = integer(days[1]), d = integer(days[2]), hour = integer(clock[0]),
             minute = integer(clock[1]);
  const auto second_ns = seconds_to_ns(clock[2]);
  if (!y || !m || !d || !hour || !minute || !second_ns) return std::nullopt;
  const year_month_day day(year(*y), month(static_cast<unsigned>(*m)), std::chrono::day(static_cast<unsigned>(*d)));
  if (!day.ok()) return std::nullopt;
  const auto whole = sys_days(day).time_since_epoch() + hours(*hour) + minutes(*minute);
  return duration_cast<nanoseconds>(whole).count() + *second_ns;
}

void check_degrees(const TextTable& table, const TextRow& row, const GeodeticFix& fix) {
  if (std::abs(fix.latitude_deg) <= 90.0 && std::abs(fix.longitude_deg) <= 360.0) return;
  table.fail(row, "latitude and longitude must be degrees");
}

GeodeticFix read_fix(const TextTable& table, const TextRow& row) {
  if (row.fields.size() < kColumns) table.fail(row, "a line must be date, time, latitude, longitude, height, Q, ...");
  const auto t_ns = calendar_ns(row.fields[0], row.fields[1]);
  if (!t_ns) table.fail(row, "'" + row.fields[0] + " " + row.fields[1] + "' is no time like 2021/07/07 12:34:50.200");
  const GeodeticFix fix{*t_ns, table.number(row, 3), table.number(row, 2), table.number(row, 4),
                        static_cast<int>(table.integer(row, 5))};
  check_degrees(table, row, fix);
  return fix;
}

/// Where a geodetic CSV keeps what; from its first line.
struct CsvColumns {
  std::optional<std::size_t> time, longitude, latitude, height;
  bool time_is_ns = false;
};

bool has_any(const std::string& name, std::initializer_list<const char*> parts) {
  return std::any_of(parts.begin(), parts.end(),
                     [&](const char* part) { return name.find(part) != std::string::npos; });
}

CsvColumns columns_of(const std::string& text) {
  std::string header = text.substr(text.find_first_not_of("#%\xEF\xBB\xBF "));
  header = header.substr(0, header.find_first_of("\r\n"));
  std::transform(header.begin(), header.end(), header.begin(), [](unsigned char c) { return std::tolower(c); });
  CsvColumns columns;
  const std::vector<std::string> names = split(header, ',');
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (!columns.time && has_any(names[i], {"time", "t_ns", "t_s", "stamp"})) {
      columns.time = i;
      columns.time_is_ns = has_any(names[i], {"_ns", "[ns]", "(ns)"});
    }
    if (!columns.longitude && has_any(names[i], {"lon"})) columns.longitude = i;
    if (!columns.latitude && has_any(names[i], {"lat"})) columns.latitude = i;
    if (!columns.height && has_any(names[i], {"height", "alt"})) columns.height = i;
  }
  return columns;
}

/// The first non-blank line, without reading a large file whole.
std::string first_line(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string line;
  while (std::getline(stream, line) && line.find_first_not_of(" \r\t") == std::string::npos) line.clear();
  return line;
}

std::vector<GeodeticFix> read_csv(const std::filesystem::path& file) {
  const std::string text = read_text(file);
  const CsvColumns columns = columns_of(text);
  if (!columns.time || !columns.longitude || !columns.latitude || !columns.height) {
    throw Error::at(file.string(), 1, "the header must name a time, a longitude, a latitude and a height");
  }
  const TextTable table = parse_table(text, file.string());
  std::vector<GeodeticFix> fixes;
  for (const TextRow& row : table.rows) {
    if (&row == &table.rows.front() && row.line == 1) continue;  // the header, where it is no comment
    const std::string& time = row.fields.at(std::min(*columns.time, row.fields.size() - 1));
    const bool ns = columns.time_is_ns || std::abs(table.number(row, *columns.time)) >= 1e10;
    const auto t_ns = scaled_integer(time, ns ? 0 : 9);
    if (!t_ns) table.fail(row, "'" + time + "' is no time");
    const GeodeticFix fix{*t_ns, table.number(row, *columns.longitude), table.number(row, *columns.latitude),
                          table.number(row, *columns.height)};
    check_degrees(table, row, fix);
    if (!fixes.empty() && fix.t_ns <= fixes.back().t_ns) table.fail(row, "the times must increase");
    fixes.push_back(fix);
  }
  if (fixes.empty()) throw Error(file.string() + ": there is no position in this file");
  return fixes;
}

}  // namespace

bool is_geodetic(const std::filesystem::path& file) {
  if (file.extension() == ".pos") return true;
  const std::string line = first_line(file);
  if (line.find(',') == std::string::npos) return false;
  const CsvColumns columns = columns_of(line);
  return columns.longitude && columns.latitude;
}

GeodeticFile read_geodetic(const std::filesystem::path& file) {
  if (file.extension() == ".pos") return {read_pos(file), true};
  return {read_csv(file), false};
}

std::vector<GeodeticFix> read_pos(const std::filesystem::path& file) {
  const std::string text = read_text(file);
  if (text.find("-baseline(m)") != std::string::npos) {
    throw Error(file.string() + ": holds baselines; the file with latitude, longitude and height is needed");
  }
  const TextTable table = parse_table(text, file.string());
  std::vector<GeodeticFix> fixes;
  for (const TextRow& row : table.rows) {
    const GeodeticFix fix = read_fix(table, row);
    if (!fixes.empty() && fix.t_ns <= fixes.back().t_ns) table.fail(row, "the times must increase");
    fixes.push_back(fix);
  }
  return fixes;
}

Trajectory positions_in_map(const std::vector<GeodeticFix>& fixes, const Georeference& georeference,
                            const GeodeticOptions& options) {
  Trajectory trajectory;
  for (const GeodeticFix& fix : fixes) {
    if (fix.quality > options.worst_quality) continue;
    const Eigen::Vector3d lon_lat_height(fix.longitude_deg, fix.latitude_deg,
                                         fix.height_m - options.geoid_undulation_m);
    trajectory.push_back(
        {fix.t_ns, Pose(Eigen::Quaterniond::Identity(), georeference.map_from_lon_lat_height(lon_lat_height))});
  }
  if (trajectory.empty())
    throw Error("none of the fixes has a quality Q of " + std::to_string(options.worst_quality) + " or better");
  return trajectory;
}

}  // namespace demslam
