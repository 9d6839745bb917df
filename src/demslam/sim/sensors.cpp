#include "demslam/sim/sensors.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <format>
#include <map>
#include <numbers>

#include "demslam/base/random.h"
#include "demslam/geometry/angle.h"
#include "demslam/sim/lens.h"

namespace demslam {
namespace {

constexpr double kGravity = 1.625;  // m/s^2, the Moon's surface
constexpr double kImuRate = 100.0, kWheelRate = 10.0;

Eigen::Vector3d normal3(Random& random, double sigma) {
  const double x = random.normal(), y = random.normal(), z = random.normal();
  return sigma * Eigen::Vector3d(x, y, z);
}

/// Angular rate and specific force in the body.
struct Inertial {
  Eigen::Vector3d rate, force;
};

constexpr std::int64_t kHalf = 5;  // samples: differences over 0.1 s, the structure's own low pass

/// By central differences.
Inertial inertial(const Pose& before, const Pose& now, const Pose& after) {
  const double h = kHalf / kImuRate;
  const Eigen::Vector3d turn = (before.inverse() * after).log().head<3>();
  const Eigen::Vector3d acceleration = (after.translation() - 2.0 * now.translation() + before.translation()) / (h * h);
  return {turn / (2.0 * h), now.rotation().conjugate() * (acceleration + Eigen::Vector3d(0.0, 0.0, kGravity))};
}

/// The poses of the IMU's samples `first` to `last`, inclusive, on all cores.
std::vector<Pose> sampled(const PoseAtTime& motion, std::int64_t first, std::int64_t last) {
  std::vector<Pose> poses(static_cast<std::size_t>(last - first + 1));
  tbb::parallel_for(first, last + 1, [&](std::int64_t i) {
    poses[static_cast<std::size_t>(i - first)] = motion(static_cast<double>(i) / kImuRate);
  });
  return poses;
}

/// Craters inside whose rim a map position may lie, by squares of 8 m.
class CraterMap {
 public:
  CraterMap(const Terrain& terrain, const Eigen::Vector2d& centre, double reach_m) {
    for (const Crater& crater : terrain.craters(centre, reach_m, kSmallest)) {
      const double r = 0.5 * crater.diameter_m;
      if (crater.depth_m < 0.03 * crater.diameter_m) continue;  // almost erased
      for (auto y = square(crater.y_m - r); y <= square(crater.y_m + r); ++y) {
        for (auto x = square(crater.x_m - r); x <= square(crater.x_m + r); ++x) squares_[{x, y}].push_back(crater);
      }
    }
  }

  bool inside(double x, double y) const {
    const auto found = squares_.find({square(x), square(y)});
    if (found == squares_.end()) return false;
    return std::any_of(found->second.begin(), found->second.end(), [&](const Crater& crater) {
      return std::hypot(x - crater.x_m, y - crater.y_m) < 0.5 * crater.diameter_m;
    });
  }

 private:
  static constexpr double kSmallest = 0.5;
  static std::int64_t square(double position) { return static_cast<std::int64_t>(std::floor(position / 8.0)); }

  std::map<std::pair<std::int64_t, std::int64_t>, std::vector<Crater>> squares_;
};

constexpr double kLabelReach = 60.0;  // craters farther away are labelled regolith

}  // namespace

ImuBias imu_bias(std::uint64_t seed) {
  Random random(seed, 0x696d75);
  const Eigen::Vector3d gyro = normal3(random, 1e-4);
  return {gyro, normal3(random, 2e-3)};
}

std::string imu_text(const PoseAtTime& motion, TimestampNs first_ns, double duration_s, std::uint64_t seed) {
  const ImuBias bias = imu_bias(seed);
  const double root_rate = std::sqrt(kImuRate);
  Random random(seed, 0x696d7532);
  std::string text =
      "#timestamp [ns], w_x [rad s^-1], w_y [rad s^-1], w_z [rad s^-1], a_x [m s^-2], a_y [m s^-2], a_z [m s^-2]\n";
  constexpr std::int64_t kBlock = 10000;  // samples whose poses are in memory
  const auto last = static_cast<std::int64_t>(std::floor(duration_s * kImuRate + 1e-6));
  std::vector<Pose> poses;
  for (std::int64_t i = 0, first = 0; i <= last; ++i) {
    if (i % kBlock == 0) {
      first = std::max<std::int64_t>(i - 2 * kHalf, 0);
      poses = sampled(motion, first, std::max(std::min(i + kBlock - 1, last) + kHalf, 2 * kHalf));
    }
    const auto at = [&](std::int64_t sample) -> const Pose& { return poses[static_cast<std::size_t>(sample - first)]; };
    const std::int64_t middle = std::clamp(i, kHalf, std::max(kHalf, last - kHalf));
    const Inertial truth = inertial(at(middle - kHalf), at(middle), at(middle + kHalf));
    const Eigen::Vector3d w = truth.rate + bias.gyro + normal3(random, 1.7e-4 * root_rate);
    const Eigen::Vector3d a = truth.force + bias.accelerometer + normal3(random, 2e-3 * root_rate);
    char line[200];
    std::snprintf(line, sizeof line, "%lld,%.8f,%.8f,%.8f,%.7f,%.7f,%.7f\n",
                  static_cast<long long>(first_ns + i * 10'000'000), w.x(), w.y(), w.z(), a.x(), a.y(), a.z());
    text += line;
  }
  return text;
}

std::string wheels_text(const PoseAtTime& motion, TimestampNs first_ns, double duration_s, const RoverOptions& rover,
                        std::uint64_t seed) {
  Random random(seed, 0x776865656c);
  std::string text = "#timestamp [ns], left [m], right [m]\n";
  double left = 0.0, right = 0.0;
  Pose last = motion(0.0);
  for (std::int64_t i = 0; static_cast<double>(i) / kWheelRate <= duration_s; ++i) {
    const Pose now = motion(static_cast<double>(i) / kWheelRate), step = last.inverse() * now;
    const double climb_deg =
        std::asin(std::clamp((now.rotation() * Eigen::Vector3d::UnitX()).z(), -1.0, 1.0)) / kRadPerDeg;
    const double slip = 1.0 + 0.01 * rover.slip_percent_per_deg * climb_deg, turn = 0.5 * rover.track_m * step.log()[2];
    left += (step.translation().x() - turn) * (slip + 0.01 * random.normal());
    right += (step.translation().x() + turn) * (slip + 0.01 * random.normal());
    last = now;
    char line[100];
    std::snprintf(line, sizeof line, "%lld,%.6f,%.6f\n", static_cast<long long>(first_ns + i * 100'000'000), left,
                  right);
    text += line;
  }
  return text;
}

std::string sun_text(const Trajectory& trajectory, const Eigen::Vector3d& sun_map, double sigma_deg,
                     std::uint64_t seed) {
  Random random(seed, 0x73756e);
  std::string text = "#timestamp [ns], x, y, z in the body, sigma [deg], x, y, z in the map\n";
  for (const StampedPose& stamped : trajectory) {
    Vector6d error = Vector6d::Zero();
    for (int axis = 0; axis < 3; ++axis) error[axis] = sigma_deg * kRadPerDeg * random.normal();
    const Eigen::Vector3d seen = (stamped.pose * Pose::exp(error)).rotation().conjugate() * sun_map;
    text += std::format("{},{:.9f},{:.9f},{:.9f},{:g},{:.9f},{:.9f},{:.9f}\n", stamped.t_ns, seen.x(), seen.y(),
                        seen.z(), sigma_deg, sun_map.x(), sun_map.y(), sun_map.z());
  }
  return text;
}

Lidar::Lidar() : T_body_lidar(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1.0, 0.0, 1.7)) {
  for (int azimuth = 0; azimuth < kAzimuths; ++azimuth) {
    const double around = 2.0 * std::numbers::pi * azimuth / kAzimuths;
    for (int beam = 0; beam < kBeams; ++beam) {
      const double up = (15.0 - 40.0 * beam / (kBeams - 1)) * kRadPerDeg;
      directions.emplace_back(std::cos(up) * std::cos(around), std::cos(up) * std::sin(around), std::sin(up));
    }
  }
}

std::vector<LidarPoint> Lidar::scan(const Renderer& renderer, const Terrain& terrain, const Pose& T_map_lidar,
                                    std::uint64_t seed) const {
  constexpr int kRegolith = -1, kCrater = 0, kRock = 174;
  const std::vector<RangeReturn> returns = renderer.cast(T_map_lidar, directions);
  const CraterMap craters(terrain, T_map_lidar.translation().head<2>(), kRangeM);
  Random random(seed);
  std::vector<LidarPoint> points;
  for (std::size_t i = 0; i < returns.size(); ++i) {
    if (!(returns[i].range <= kRangeM)) continue;
    const Eigen::Vector3d p = (returns[i].range + kNoiseM * random.normal()) * directions[i], p_map = T_map_lidar * p;
    const int ground = craters.inside(p_map.x(), p_map.y()) ? kCrater : kRegolith;
    points.push_back({p, returns[i].surface == Surface::rock ? kRock : ground});
  }
  return points;
}

std::string lidar_text(const std::vector<LidarPoint>& scan) {
  std::string text;
  for (const auto& [p, category] : scan) {
    char line[80];
    std::snprintf(line, sizeof line, "%.4f,%.4f,%.4f,%d\n", p.x(), p.y(), p.z(), category);
    text += line;
  }
  return text;
}

Image label_image(const Rendering& rendering, const Camera& camera, const Pose& T_map_camera, const Terrain& terrain) {
  const CraterMap craters(terrain, T_map_camera.translation().head<2>(), kLabelReach);
  Image labels(rendering.width, rendering.height);
  for (int v = 0; v < rendering.height; ++v) {
    for (int u = 0; u < rendering.width; ++u) {
      const std::size_t i = static_cast<std::size_t>(v) * rendering.width + u;
      if (rendering.surface[i] == Surface::sky) continue;
      const Eigen::Vector3d p_map = T_map_camera * Eigen::Vector3d(rendering.depth_m[i] * ray_of(camera, u, v));
      const std::uint8_t ground = craters.inside(p_map.x(), p_map.y()) ? 2 : 1;
      labels.pixels[i] = rendering.surface[i] == Surface::rock ? 3 : ground;
    }
  }
  return labels;
}

}  // namespace demslam
