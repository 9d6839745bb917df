#include "demslam/evaluation/geodetic_track.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
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

GeodeticFix read_fix(const TextTable& table, const TextRow& row) {
  if (row.fields.size() < kColumns) table.fail(row, "a line must be date, time, latitude, longitude, height, Q, ...");
  const auto t_ns = calendar_ns(row.fields[0], row.fields[1]);
  if (!t_ns) table.fail(row, "'" + row.fields[0] + " " + row.fields[1] + "' is no time like 2021/07/07 12:34:50.200");
  const GeodeticFix fix{*t_ns, table.number(row, 3), table.number(row, 2), table.number(row, 4),
                        static_cast<int>(table.integer(row, 5))};
  if (std::abs(fix.latitude_deg) > 90.0 || std::abs(fix.longitude_deg) > 360.0) {
    table.fail(row, "latitude and longitude must be degrees");
  }
  return fix;
}

}  // namespace

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
