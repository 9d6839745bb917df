#include "demslam/dataset/sensors.h"

#include <bit>
#include <fstream>
#include <functional>
#include <sstream>

#include "demslam/base/error.h"
#include "demslam/base/text.h"

namespace demslam {
namespace {

void check_columns(const TextTable& table, const TextRow& row, std::size_t count, const char* meaning) {
  if (row.fields.size() != count) table.fail(row, std::string("a line must be '") + meaning + "'");
}

Eigen::Vector3d vector_at(const TextTable& table, const TextRow& row, std::size_t column) {
  return {table.number(row, column), table.number(row, column + 1), table.number(row, column + 2)};
}

template <class Sample>
void check_increasing(const TextTable& table, const TextRow& row, const std::vector<Sample>& earlier,
                      TimestampNs t_ns) {
  if (!earlier.empty() && t_ns <= earlier.back().t_ns) table.fail(row, "the stamps must increase");
}

ImuSample mean_of(const std::vector<ImuSample>& samples) {
  if (samples.size() == 1) return samples.front();
  ImuSample mean{.t_ns = samples.front().t_ns + (samples.back().t_ns - samples.front().t_ns) / 2};
  for (const ImuSample& sample : samples) {
    mean.angular_rate_rad_s += sample.angular_rate_rad_s;
    mean.acceleration_m_s2 += sample.acceleration_m_s2;
  }
  mean.angular_rate_rad_s /= static_cast<double>(samples.size());
  mean.acceleration_m_s2 /= static_cast<double>(samples.size());
  return mean;
}

/// A table too long to be held: a few thousand lines at a time.
void for_each_row(const std::filesystem::path& file,
                  const std::function<void(const TextTable&, const TextRow&)>& visit) {
  constexpr int kLines = 5000;
  std::ifstream stream(file);
  if (!stream) throw Error(file.string() + ": cannot be read; check the path and its permissions");
  std::string line, part;
  for (int done = 0, count = 0; stream; done += count) {
    part.clear();
    for (count = 0; count < kLines && std::getline(stream, line); ++count) part += line + "\n";
    TextTable table = parse_table(part, file.string());
    for (TextRow& row : table.rows) {
      row.line += done;
      visit(table, row);
    }
  }
}

float float_at(const char* bytes, bool little_endian) {
  std::uint32_t word = 0;
  for (int i = 0; i < 4; ++i) {
    word |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[little_endian ? i : 3 - i])) << (8 * i);
  }
  return std::bit_cast<float>(word);
}

}  // namespace

std::vector<LidarPoint> read_lidar_scan(const std::filesystem::path& file) {
  const TextTable table = read_table(file);
  std::vector<LidarPoint> points;
  points.reserve(table.rows.size());
  for (const TextRow& row : table.rows) {
    check_columns(table, row, 4, "x,y,z,category");
    points.push_back({vector_at(table, row, 0), static_cast<int>(table.number(row, 3))});
  }
  return points;
}

std::vector<ImuSample> read_imu(const std::filesystem::path& file, TimestampNs period_ns) {
  std::vector<ImuSample> means, period;
  for_each_row(file, [&](const TextTable& table, const TextRow& row) {
    check_columns(table, row, 7, "t [ns], w xyz [rad/s], a xyz [m/s^2]");
    const ImuSample sample{table.integer(row, 0), vector_at(table, row, 1), vector_at(table, row, 4)};
    check_increasing(table, row, period.empty() ? means : period, sample.t_ns);
    if (!period.empty() && sample.t_ns - period.front().t_ns >= period_ns) {
      means.push_back(mean_of(period));
      period.clear();
    }
    period.push_back(sample);
  });
  if (!period.empty()) means.push_back(mean_of(period));
  return means;
}

std::vector<WheelSample> read_wheels(const std::filesystem::path& file) {
  std::vector<WheelSample> samples;
  for_each_row(file, [&](const TextTable& table, const TextRow& row) {
    check_columns(table, row, 3, "t [ns], left, right [m]");
    const WheelSample sample{table.integer(row, 0), table.number(row, 1), table.number(row, 2)};
    check_increasing(table, row, samples, sample.t_ns);
    samples.push_back(sample);
  });
  return samples;
}

DepthImage read_pfm(const std::filesystem::path& file) {
  const std::string bytes = read_text(file);
  std::istringstream head(bytes.substr(0, 200));
  std::string magic;
  DepthImage image;
  double scale = 0.0;
  head >> magic >> image.width >> image.height >> scale;
  if (!head || magic != "Pf" || image.width <= 0 || image.height <= 0 || scale == 0.0) {
    throw Error(file.string() + ": no PFM with one channel; its head must be 'Pf', width, height and scale");
  }
  const std::size_t begin = static_cast<std::size_t>(head.tellg()) + 1;  // one blank ends the head
  const auto width = static_cast<std::size_t>(image.width), height = static_cast<std::size_t>(image.height);
  if (bytes.size() != begin + 4 * width * height) {
    throw Error(file.string() + ": " + std::to_string(bytes.size()) + " bytes where the PFM's head promises " +
                std::to_string(begin + 4 * width * height) + "; the file is damaged");
  }
  image.depth_m.resize(width * height);
  for (std::size_t row = 0; row < height; ++row) {
    const char* line = bytes.data() + begin + 4 * width * (height - 1 - row);
    for (std::size_t u = 0; u < width; ++u) image.depth_m[row * width + u] = float_at(line + 4 * u, scale < 0.0);
  }
  return image;
}

}  // namespace demslam
