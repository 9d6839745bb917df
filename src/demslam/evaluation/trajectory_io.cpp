#include "demslam/evaluation/trajectory_io.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "demslam/base/error.h"
#include "demslam/base/text.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

constexpr TimestampNs kKittiStepNs = 100'000'000;

TrajectoryFormat recognise(const TextTable& table) {
  const TextRow& first = table.rows.front();
  if (table.commas && first.fields.size() >= 8) return TrajectoryFormat::euroc;
  if (!table.commas && first.fields.size() == 8) return TrajectoryFormat::tum;
  if (!table.commas && first.fields.size() == 12) return TrajectoryFormat::kitti;
  table.fail(first, std::to_string(first.fields.size()) +
                        " columns fit no trajectory; known are TUM (8, blanks), KITTI (12, blanks) and EuRoC or LuSNAR "
                        "(8 or more, commas)");
}

Eigen::Vector3d position(const TextTable& table, const TextRow& row) {
  return {table.number(row, 1), table.number(row, 2), table.number(row, 3)};
}

Pose posed(const TextTable& table, const TextRow& row, double w, double x, double y, double z) {
  const Eigen::Quaterniond rotation(w, x, y, z);
  if (std::abs(rotation.norm() - 1.0) > 0.01) table.fail(row, "the quaternion has not the length 1");
  return Pose(rotation, position(table, row));
}

/// Seconds, or nanoseconds where seconds would lie beyond the year 2286.
bool stamps_are_ns(const TextTable& table) {
  double latest = 0.0;
  for (const TextRow& row : table.rows) latest = std::max(latest, std::abs(table.number(row, 0)));
  return latest >= 1e10;
}

TimestampNs tum_stamp(const TextTable& table, const TextRow& row, bool is_ns) {
  const auto t_ns = scaled_integer(row.fields.front(), is_ns ? 0 : 9);
  if (!t_ns) table.fail(row, "'" + row.fields.front() + "' is no stamp");
  return *t_ns;
}

Trajectory read_tum(const TextTable& table) {
  const bool is_ns = stamps_are_ns(table);
  Trajectory poses;
  for (const TextRow& row : table.rows) {
    const auto n = [&](std::size_t column) { return table.number(row, column); };
    poses.push_back({tum_stamp(table, row, is_ns), posed(table, row, n(7), n(4), n(5), n(6))});
  }
  return poses;
}

Trajectory read_euroc(const TextTable& table) {
  Trajectory poses;
  for (const TextRow& row : table.rows) {
    const auto n = [&](std::size_t column) { return table.number(row, column); };
    poses.push_back({table.integer(row, 0), posed(table, row, n(4), n(5), n(6), n(7))});
  }
  return poses;
}

Trajectory read_kitti(const TextTable& table) {
  Trajectory poses;
  for (const TextRow& row : table.rows) {
    Eigen::Matrix<double, 3, 4> m;
    for (std::size_t i = 0; i < 12; ++i) m(i / 4, i % 4) = table.number(row, i);
    const Eigen::Matrix3d R = m.leftCols<3>();
    if (!(R * R.transpose()).isIdentity(1e-2) || R.determinant() < 0.0) table.fail(row, "the matrix is no rotation");
    poses.push_back({static_cast<TimestampNs>(poses.size()) * kKittiStepNs, Pose(R, Eigen::Vector3d(m.col(3)))});
  }
  return poses;
}

void check_columns(const TextTable& table) {
  const std::size_t columns = table.rows.front().fields.size();
  for (const TextRow& row : table.rows) {
    if (row.fields.size() == columns) continue;
    table.fail(row, fmt::format("{} columns where the lines above have {}", row.fields.size(), columns));
  }
}

void check_stamps(const TextTable& table, const Trajectory& poses) {
  for (std::size_t i = 1; i < poses.size(); ++i) {
    if (poses[i].t_ns > poses[i - 1].t_ns) continue;
    const bool duplicate = poses[i].t_ns == poses[i - 1].t_ns;
    table.fail(table.rows[i],
               std::string(duplicate ? "the stamp is the same as the line before's; remove one of the two"
                                     : "the stamp is before that of the line above; sort the file"));
  }
}

TrajectoryFile parse(const TextTable& table) {
  if (table.rows.empty()) throw Error(table.source + ": there is no pose in this file");
  TrajectoryFile file{.format = recognise(table)};
  check_columns(table);
  switch (file.format) {
    case TrajectoryFormat::tum:
      file.poses = read_tum(table);
      break;
    case TrajectoryFormat::euroc:
      file.poses = read_euroc(table);
      break;
    case TrajectoryFormat::kitti:
      file.poses = read_kitti(table);
      break;
  }
  file.indexed = file.format == TrajectoryFormat::kitti;
  check_stamps(table, file.poses);
  return file;
}

/// Gives KITTI poses the stamps of `times` if that file is there with as many lines.
bool take_stamps(TrajectoryFile& file, const fs::path& times) {
  if (!fs::is_regular_file(times)) return false;
  const TextTable table = read_table(times);
  if (table.rows.size() != file.poses.size()) return false;
  for (std::size_t i = 0; i < file.poses.size(); ++i) {
    const auto t_ns = seconds_to_ns(table.rows[i].fields.front());
    if (!t_ns) table.fail(table.rows[i], "'" + table.rows[i].fields.front() + "' is no time in seconds");
    file.poses[i].t_ns = *t_ns;
  }
  check_stamps(table, file.poses);
  return true;
}

std::string numbers_text(const Eigen::Vector3d& p, std::string_view separator) {
  return fmt::format("{:.9f}{}{:.9f}{}{:.9f}", p.x(), separator, p.y(), separator, p.z());
}

}  // namespace

std::string_view name_of(TrajectoryFormat format) {
  switch (format) {
    case TrajectoryFormat::tum:
      return "TUM";
    case TrajectoryFormat::kitti:
      return "KITTI";
    case TrajectoryFormat::euroc:
      return "EuRoC";
  }
  return "";
}

TrajectoryFile parse_trajectory(std::string_view text, const std::string& source) {
  return parse(parse_table(text, source));
}

TrajectoryFile read_trajectory(const fs::path& path) {
  TrajectoryFile file = parse(read_table(path));
  if (!file.indexed) return file;
  const fs::path folder = fs::absolute(path).parent_path();
  file.indexed = !take_stamps(file, folder / "times.txt") &&
                 !take_stamps(file, folder.parent_path() / "sequences" / path.stem() / "times.txt");
  return file;
}

std::string tum_text(const Trajectory& trajectory) {
  std::string text = "# timestamp tx ty tz qx qy qz qw\n";
  for (const auto& [t_ns, pose] : trajectory) {
    const Eigen::Quaterniond& q = pose.rotation();
    text += fmt::format("{} {} {:.12f} {:.12f} {:.12f} {:.12f}\n", seconds_text(t_ns),
                        numbers_text(pose.translation(), " "), q.x(), q.y(), q.z(), q.w());
  }
  return text;
}

std::string kitti_text(const Trajectory& trajectory) {
  std::string text;
  for (const auto& [t_ns, pose] : trajectory) {
    const Eigen::Matrix4d m = pose.matrix();
    for (int i = 0; i < 12; ++i) text += fmt::format("{}{:.12e}", i == 0 ? "" : " ", m(i / 4, i % 4));
    text += "\n";
  }
  return text;
}

std::string euroc_text(const Trajectory& trajectory) {
  std::string text = "#timestamp [ns],p_x [m],p_y [m],p_z [m],q_w [],q_x [],q_y [],q_z []\n";
  for (const auto& [t_ns, pose] : trajectory) {
    const Eigen::Quaterniond& q = pose.rotation();
    text += fmt::format("{},{},{:.12f},{:.12f},{:.12f},{:.12f}\n", t_ns, numbers_text(pose.translation(), ","), q.w(),
                        q.x(), q.y(), q.z());
  }
  return text;
}

bool has_rotation(const Trajectory& trajectory) {
  return std::any_of(trajectory.begin(), trajectory.end(), [](const StampedPose& stamped) {
    return std::abs(stamped.pose.rotation().w()) < 1.0 || stamped.pose.rotation().vec().norm() > 0.0;
  });
}

}  // namespace demslam
