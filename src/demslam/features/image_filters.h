#pragma once

#include <array>
#include <functional>
#include <vector>

#include "demslam/image/image.h"

namespace demslam {

/// Float image, row-major, `channels` values per pixel side by side.
struct Plane {
  int width = 0, height = 0, channels = 1;
  std::vector<float> values;

  Plane(int width_px, int height_px, int channels_per_pixel = 1)
      : width(width_px), height(height_px), channels(channels_per_pixel), values(row_size() * height_px) {}

  std::size_t row_size() const { return static_cast<std::size_t>(width) * channels; }
  float* row(int v) { return values.data() + v * row_size(); }
  const float* row(int v) const { return values.data() + v * row_size(); }
};

/// Symmetric five-tap filter: weights of the centre, its neighbours, and theirs.
struct Taps {
  float centre, near, far;
};
inline constexpr Taps kBinomial{6.0F / 16.0F, 4.0F / 16.0F, 1.0F / 16.0F};  ///< nearly a Gaussian of sigma 1
inline constexpr Taps kWide{0.24F, 0.22F, 0.16F};  ///< sigma 1.3: smoother peaks, less pulled to whole pixels
inline constexpr Taps kTriangle{3.0F / 9.0F, 2.0F / 9.0F, 1.0F / 9.0F};

/// Filters rows and columns in one sweep that keeps five rows at hand: `input` writes row v, `output` gets the filtered
/// row v. Beyond the edge the last pixel repeats.
struct RowSweep {
  int width = 0, height = 0, channels = 1;
  std::function<void(int v, float* row)> input;
  std::function<void(int v, const float* row)> output;
};
void filter_rows(const RowSweep& sweep, const Taps& taps);

/// The image, smoothed by the binomial filter.
Plane smooth(const Image& image);

/// Foerstner's corner measure det / trace of the smoothed gradient tensor, in (grey levels per pixel)^2: about the
/// smaller eigenvalue, but smooth, which is what a sub-pixel peak needs.
Plane corner_response(const Plane& smoothed);

/// Eight half-rectified gradient directions (0, 45, ... degrees from +u towards +v), pooled over cells about 6 px wide,
/// on a grid of half the resolution: the centre of grid cell (i, j) is pixel (2 i + 0.5, 2 j + 0.5).
inline constexpr int kDirections = 8;
Plane gradient_directions(const Plane& smoothed);

}  // namespace demslam
