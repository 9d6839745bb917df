#include "demslam/dataset/sun_sensor.h"

#include "demslam/base/text.h"

namespace demslam {
namespace {

Eigen::Vector3d direction_at(const TextTable& table, const TextRow& row, std::size_t column) {
  const Eigen::Vector3d d(table.number(row, column), table.number(row, column + 1), table.number(row, column + 2));
  if (d.norm() < 1e-6) table.fail(row, "a direction must not be zero");
  return d.normalized();
}

}  // namespace

std::vector<SunMeasurement> read_sun(const std::filesystem::path& file) {
  const TextTable table = read_table(file);
  std::vector<SunMeasurement> measurements;
  for (const TextRow& row : table.rows) {
    if (row.fields.size() != 5 && row.fields.size() != 8)
      table.fail(row, "a line must be 't [ns], x, y, z in the body, sigma [deg]' and may add 'x, y, z in the map'");
    SunMeasurement m{table.integer(row, 0), direction_at(table, row, 1), table.number(row, 4)};
    if (m.sigma_deg <= 0.0) table.fail(row, "sigma must be positive");
    if (row.fields.size() == 8) m.sun_map = direction_at(table, row, 5);
    if (!measurements.empty() && m.t_ns <= measurements.back().t_ns) table.fail(row, "the stamps must increase");
    measurements.push_back(m);
  }
  return measurements;
}

}  // namespace demslam
