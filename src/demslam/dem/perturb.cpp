#include "demslam/dem/perturb.h"

#include <cmath>

#include "demslam/base/random.h"

namespace demslam {
namespace {

/// Gaussian of the given standard deviation in cells, scaled so that filtered white noise keeps unit variance.
std::vector<double> unit_energy_gaussian(double sigma_cells) {
  const int half = static_cast<int>(std::ceil(4.0 * sigma_cells));
  std::vector<double> kernel;
  double energy = 0.0;
  for (int i = -half; i <= half; ++i) {
    kernel.push_back(std::exp(-0.5 * i * i / (sigma_cells * sigma_cells)));
    energy += kernel.back() * kernel.back();
  }
  for (double& weight : kernel) weight /= std::sqrt(energy);
  return kernel;
}

/// One row of white noise, filtered along the row; `row` names its random stream.
std::vector<float> filtered_row(const std::vector<double>& kernel, std::uint64_t seed, int row, int cols) {
  Random random(seed, static_cast<std::uint64_t>(row));
  std::vector<double> white(cols + kernel.size() - 1);
  for (double& value : white) value = random.normal();
  std::vector<float> filtered(cols);
  for (int col = 0; col < cols; ++col) {
    double sum = 0.0;
    for (std::size_t k = 0; k < kernel.size(); ++k) sum += kernel[k] * white[col + k];
    filtered[col] = static_cast<float>(sum);
  }
  return filtered;
}

}  // namespace

std::vector<float> gaussian_field(const GaussianField& field, int rows, int cols, double cell_m) {
  // Filtering by exp(-x^2 / 2 s^2) correlates by exp(-d^2 / 4 s^2): s is half the correlation length.
  const auto kernel = unit_energy_gaussian(std::max(1e-3, 0.5 * field.correlation_length_m / cell_m));
  const int taps = static_cast<int>(kernel.size());
  std::vector<std::vector<float>> recent(taps);  // a ring of the last filtered rows
  for (int row = 0; row < taps - 1; ++row) recent[row] = filtered_row(kernel, field.seed, row, cols);

  std::vector<float> values(static_cast<std::size_t>(rows) * cols, 0.0F);
  std::vector<double> sums(cols);
  for (int row = 0; row < rows; ++row) {
    recent[(row + taps - 1) % taps] = filtered_row(kernel, field.seed, row + taps - 1, cols);
    sums.assign(cols, 0.0);
    for (int k = 0; k < taps; ++k) {
      const std::vector<float>& source = recent[(row + k) % taps];
      for (int col = 0; col < cols; ++col) sums[col] += kernel[k] * source[col];
    }
    float* const out = &values[static_cast<std::size_t>(row) * cols];
    for (int col = 0; col < cols; ++col) out[col] = static_cast<float>(field.rms * sums[col]);
  }
  return values;
}

DemRaster perturb(DemRaster dem, const Perturbation& perturbation) {
  if (perturbation.noise_m.rms > 0.0) {
    const auto noise = gaussian_field(perturbation.noise_m, dem.rows, dem.cols, dem.cell_m);
    for (std::size_t i = 0; i < noise.size(); ++i) dem.heights[i] += noise[i];
  }
  for (float& height : dem.heights) height += static_cast<float>(perturbation.bias_m);
  dem.west_m += perturbation.shift_m.x();
  dem.north_m += perturbation.shift_m.y();
  return dem;
}

}  // namespace demslam
