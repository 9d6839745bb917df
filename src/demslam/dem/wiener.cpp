#include "demslam/dem/wiener.h"

#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace demslam {
namespace {

constexpr int kRadius = 9;  // cells: the kernel is 19 x 19
constexpr int kSide = 2 * kRadius + 1;
constexpr int kTaps = kSide * kSide;
constexpr int kShortLag = 8, kLongLag = 20;  // cells, where the terrain's power law is fitted
constexpr int kErrorLags = 12;               // cells, how far the remaining error's correlation is followed

/// Half the mean squared difference of heights `lag` cells apart, along both axes; none of too few.
std::optional<double> variogram(const DemRaster& dem, int lag) {
  double sum = 0.0;
  std::size_t pairs = 0;
  const auto add = [&](float a, float b) {
    const double difference = static_cast<double>(a) - b;
    if (!std::isfinite(difference)) return;
    sum += difference * difference;
    ++pairs;
  };
  for (int row = 0; row < dem.rows; ++row) {
    for (int col = 0; col < dem.cols; ++col) {
      if (col + lag < dem.cols) add(dem.at(row, col), dem.at(row, col + lag));
      if (row + lag < dem.rows) add(dem.at(row, col), dem.at(row + lag, col));
    }
  }
  constexpr std::size_t kFew = 1000;
  if (pairs < kFew) return std::nullopt;
  return 0.5 * sum / static_cast<double>(pairs);
}

/// Terrain variogram c d^p, d in cells.
struct PowerLaw {
  double c = 0.0, p = 1.0;

  /// Generalised covariance: valid between weights that sum to zero.
  double covariance(double cells) const { return -c * std::pow(cells, p); }
};

std::optional<PowerLaw> terrain_law(const DemRaster& dem, const DemErrorModel& error) {
  const double variance = error.covariance(0.0);
  const std::optional<double> short_lag = variogram(dem, kShortLag), long_lag = variogram(dem, kLongLag);
  if (!short_lag || !long_lag) return std::nullopt;
  const auto terrain = [&](int lag, double both) {
    const double of_error = variance - error.covariance(lag * dem.cell_m);
    return std::max(both - of_error, 0.01 * variance * lag / kLongLag + 1e-9);
  };
  const double near = terrain(kShortLag, *short_lag), far = terrain(kLongLag, *long_lag);
  PowerLaw law;
  law.p = std::clamp(std::log(far / near) / std::log(static_cast<double>(kLongLag) / kShortLag), 0.8, 1.9);
  law.c = far / std::pow(kLongLag, law.p);
  return law;
}

std::pair<int, int> offset_of(int tap) { return {tap % kSide - kRadius, tap / kSide - kRadius}; }

/// A function of the distance between two taps, the second one moved to the right by some cells: made once per offset.
class OfDistance {
 public:
  template <class Function>
  explicit OfDistance(const Function& of_cells) : table_(static_cast<std::size_t>(kReach) * kReach) {
    for (int dy = 0; dy < kReach; ++dy) {
      for (int dx = 0; dx < kReach; ++dx)
        table_[static_cast<std::size_t>(dy) * kReach + dx] = of_cells(std::hypot(dx, dy));
    }
  }
  double operator()(int a, int b, int shift = 0) const {
    const auto [ax, ay] = offset_of(a);
    const auto [bx, by] = offset_of(b);
    return table_[static_cast<std::size_t>(std::abs(ay - by)) * kReach + std::abs(ax - bx - shift)];
  }

 private:
  static constexpr int kReach = kSide + kErrorLags;
  std::vector<double> table_;
};

/// Covariances between taps: of the terrain (generalised) and of the DEM's error.
struct Covariances {
  OfDistance terrain, error;
};

/// Weights of the window that estimate the terrain at its centre.
Eigen::VectorXd kriging_weights(const Covariances& covariances) {
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(kTaps + 3, kTaps + 3);
  Eigen::VectorXd target = Eigen::VectorXd::Zero(kTaps + 3);
  const int centre = kTaps / 2;
  for (int i = 0; i < kTaps; ++i) {
    for (int j = 0; j < kTaps; ++j) {
      system(i, j) = covariances.terrain(i, j) + covariances.error(i, j);
    }
    target[i] = covariances.terrain(i, centre);
    const auto [dx, dy] = offset_of(i);
    const Eigen::Vector3d drift(1.0, dx, dy);
    system.block<1, 3>(i, kTaps) = drift.transpose();
    system.block<3, 1>(kTaps, i) = drift;
  }
  target[kTaps] = 1.0;
  return system.partialPivLu().solve(target).head(kTaps);
}

/// Of what the filter changes.
Eigen::VectorXd lost_weights(Eigen::VectorXd weights) {
  weights[kTaps / 2] -= 1.0;
  return weights;
}

/// Standard deviation of what the filter changes.
double taken_away(const Eigen::VectorXd& weights, const Covariances& covariances) {
  const Eigen::VectorXd lost = lost_weights(weights);
  double sum = 0.0;
  for (int i = 0; i < kTaps; ++i) {
    for (int j = 0; j < kTaps; ++j) sum += lost[i] * lost[j] * (covariances.error(i, j) + covariances.terrain(i, j));
  }
  return std::sqrt(std::max(0.0, sum));
}

/// Covariance of the filtered heights' errors `shift` cells apart: noise that passes, terrain that does not.
double remaining_covariance(const Eigen::VectorXd& weights, const Covariances& covariances, int shift) {
  const Eigen::VectorXd lost = lost_weights(weights);
  double sum = 0.0;
  for (int i = 0; i < kTaps; ++i) {
    for (int j = 0; j < kTaps; ++j) {
      sum += weights[i] * weights[j] * covariances.error(i, j, shift) +
             lost[i] * lost[j] * covariances.terrain(i, j, shift);
    }
  }
  return sum;
}

DemErrorModel remaining_error(const Eigen::VectorXd& weights, const Covariances& covariances, double cell_m) {
  const double variance = std::max(1e-6, remaining_covariance(weights, covariances, 0));
  double before = 1.0;
  for (int lag = 1; lag <= kErrorLags; ++lag) {
    const double correlation = remaining_covariance(weights, covariances, lag) / variance;
    if (correlation < std::exp(-1.0)) {
      const double part = (before - std::exp(-1.0)) / (before - correlation);
      return {std::sqrt(variance), (lag - 1 + part) * cell_m};
    }
    before = correlation;
  }
  return {std::sqrt(variance), kErrorLags * cell_m};
}

/// Weighted mean over the window. The kernel is symmetric, so cells count in opposite pairs; a pair that is not
/// complete counts as the centre, which keeps planes planes.
double filtered_height(const DemRaster& dem, const Eigen::VectorXd& weights, int row, int col) {
  const double centre = dem.at(row, col);
  double sum = weights[kTaps / 2] * centre;
  const auto height = [&](int r, int c) {
    const bool inside = r >= 0 && c >= 0 && r < dem.rows && c < dem.cols;
    return inside ? dem.at(r, c) : std::nanf("");
  };
  for (int tap = 0; tap < kTaps / 2; ++tap) {
    const auto [dx, dy] = offset_of(tap);
    const double pair = static_cast<double>(height(row + dy, col + dx)) + height(row - dy, col - dx);
    sum += weights[tap] * (std::isfinite(pair) ? pair : 2.0 * centre);
  }
  return sum;
}

}  // namespace

bool touch(const MapWindow& a, const MapWindow& b) {
  return a.west_m < b.east_m && b.west_m < a.east_m && a.south_m < b.north_m && b.south_m < a.north_m;
}

std::optional<WienerFilter> WienerFilter::of(const DemRaster& dem, const DemErrorModel& error) {
  if (dem.heights.empty()) return std::nullopt;
  const std::optional<PowerLaw> terrain = terrain_law(dem, error);
  if (!terrain) return std::nullopt;
  const Covariances covariances{OfDistance([&](double cells) { return terrain->covariance(cells); }),
                                OfDistance([&](double cells) { return error.covariance(cells * dem.cell_m); })};
  Eigen::VectorXd weights = kriging_weights(covariances);
  const DemErrorModel remaining = remaining_error(weights, covariances, dem.cell_m);
  const double takes_away_m = taken_away(weights, covariances);
  return WienerFilter(std::move(weights), remaining, takes_away_m);
}

std::optional<double> WienerFilter::noise_found(const DemRaster& dem) const {
  constexpr double kCells = 1000.0, kSigmaPerMedian = 1.4826;
  const int step = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(dem.rows) * dem.cols / kCells)));
  std::vector<double> changes;
  for (int row = kRadius; row < dem.rows - kRadius; row += step) {
    for (int col = kRadius; col < dem.cols - kRadius; col += step) {
      const double change = filtered_height(dem, weights_, row, col) - dem.at(row, col);
      if (std::isfinite(change)) changes.push_back(std::abs(change));
    }
  }
  if (changes.empty()) return std::nullopt;
  const auto middle = changes.begin() + std::ssize(changes) / 2;
  std::ranges::nth_element(changes, middle);
  return kSigmaPerMedian * *middle / std::max(1e-9, takes_away_m_);
}

DemRaster WienerFilter::filtered(const DemRaster& dem, const MapWindow& window) const {
  const CellWindow part = cells_in(dem, window);
  DemRaster result = crop(dem, window);
  tbb::parallel_for(0, result.rows, [&](int row) {
    for (int col = 0; col < result.cols; ++col) {
      result.at(row, col) = static_cast<float>(filtered_height(dem, weights_, part.row + row, part.col + col));
    }
  });
  return result;
}

BelievedDem most_probable(std::shared_ptr<const Dem> dem, const DemErrorModel& error) {
  const MapWindow everything = dem->raster().extent();
  return most_probable(std::move(dem), error, everything);
}

BelievedDem most_probable(std::shared_ptr<const Dem> dem, const DemErrorModel& error, const MapWindow& window) {
  std::optional<WienerFilter> filter;
  if (!dem->has_sigma() && touch(window, dem->raster().extent())) filter = WienerFilter::of(dem->raster(), error);
  if (!filter) return {std::move(dem), error};
  return {std::make_shared<Dem>(filter->filtered(dem->raster(), window), dem->interpolation()), filter->remaining()};
}

}  // namespace demslam
