// No Eigen here: these functions are compiled for several instruction sets (docs/architecture.md, "Eigen's ABI").
#include "demslam/features/image_filters.h"

#include <algorithm>

#include "demslam/features/vector_clones.h"

namespace demslam {
namespace {

constexpr int kReach = 2;  // of the five taps
using FiveRows = std::array<const float*, 2 * kReach + 1>;

DEMSLAM_VECTOR_CLONES void blend(const FiveRows& rows, const Taps& taps, std::size_t count, float* __restrict out) {
  const float *r0 = rows[0], *r1 = rows[1], *r2 = rows[2], *r3 = rows[3], *r4 = rows[4];
  const float far = taps.far, near = taps.near, centre = taps.centre;
  for (std::size_t i = 0; i < count; ++i) out[i] = far * (r0[i] + r4[i]) + near * (r1[i] + r3[i]) + centre * r2[i];
}

DEMSLAM_VECTOR_CLONES void to_float(const std::uint8_t* in, std::size_t count, float* __restrict out) {
  for (std::size_t i = 0; i < count; ++i) out[i] = in[i];
}

/// Central differences; the pixels at both ends have none.
DEMSLAM_VECTOR_CLONES void gradient_row(const float* above, const float* row, const float* below, std::size_t width,
                                        float* __restrict du, float* __restrict dv) {
  du[0] = dv[0] = du[width - 1] = dv[width - 1] = 0.0F;
  for (std::size_t u = 1; u + 1 < width; ++u) {
    du[u] = 0.5F * (row[u + 1] - row[u - 1]);
    dv[u] = 0.5F * (below[u] - above[u]);
  }
}

DEMSLAM_VECTOR_CLONES void tensor_row(const float* du, const float* dv, std::size_t width, float* __restrict out) {
  for (std::size_t u = 0; u < width; ++u) {
    out[3 * u] = du[u] * du[u];
    out[3 * u + 1] = du[u] * dv[u];
    out[3 * u + 2] = dv[u] * dv[u];
  }
}

DEMSLAM_VECTOR_CLONES void response_row(const float* tensor, std::size_t width, float* __restrict out) {
  constexpr float kFlat = 1e-6F;  // keeps 0 / 0 away; far below one grey level
  for (std::size_t u = 0; u < width; ++u) {
    const float uu = tensor[3 * u], uv = tensor[3 * u + 1], vv = tensor[3 * u + 2];
    out[u] = (uu * vv - uv * uv) / (uu + vv + kFlat);
  }
}

/// Adds magnitude * max(0, cos)^3 of the angle to each direction: narrow lobes without an arc tangent or a root.
DEMSLAM_VECTOR_CLONES void add_directions(const float* du, const float* dv, std::size_t cells, float* __restrict out) {
  constexpr float kFlat = 1e-6F, kDiagonal = 0.70710678F;
  constexpr std::array<float, kDirections> cosine{1, kDiagonal, 0, -kDiagonal, -1, -kDiagonal, 0, kDiagonal};
  constexpr std::array<float, kDirections> sine{0, kDiagonal, 1, kDiagonal, 0, -kDiagonal, -1, -kDiagonal};
  for (std::size_t u = 0; u < 2 * cells; ++u) {
    const float scale = 1.0F / (du[u] * du[u] + dv[u] * dv[u] + kFlat);
    float* cell = out + u / 2 * kDirections;
    for (int d = 0; d < kDirections; ++d) {
      const float along = std::max(0.0F, du[u] * cosine[d] + dv[u] * sine[d]);
      cell[d] += along * along * along * scale;
    }
  }
}

/// Gradients of row v of a smoothed image; none in the first and the last row.
class Gradients {
 public:
  explicit Gradients(const Plane& smoothed) : smoothed_(smoothed), du(smoothed.width), dv(smoothed.width) {}
  void load(int v) {
    const int above = std::max(v - 1, 0), below = std::min(v + 1, smoothed_.height - 1);
    gradient_row(smoothed_.row(above), smoothed_.row(v), smoothed_.row(below), du.size(), du.data(), dv.data());
  }

 private:
  const Plane& smoothed_;

 public:
  std::vector<float> du, dv;
};

/// The five last rows read, each padded at both ends for the horizontal taps.
class RowRing {
 public:
  explicit RowRing(const RowSweep& sweep)
      : sweep_(sweep), size_(static_cast<std::size_t>(sweep.width) * sweep.channels) {
    for (auto& row : rows_) row.resize(size_);
  }
  FiveRows around(int v) {
    for (; next_ <= std::min(v + kReach, sweep_.height - 1); ++next_)
      sweep_.input(next_, rows_[next_ % rows_.size()].data());
    FiveRows five;
    for (int i = 0; i < static_cast<int>(five.size()); ++i) {
      five[i] = rows_[std::clamp(v + i - kReach, 0, sweep_.height - 1) % rows_.size()].data();
    }
    return five;
  }

 private:
  const RowSweep& sweep_;
  std::size_t size_;
  std::array<std::vector<float>, 2 * kReach + 1> rows_;
  int next_ = 0;
};

void repeat_ends(float* row, std::size_t size, int channels) {
  for (int i = 0; i < kReach * channels; ++i) {
    row[i - kReach * channels] = row[i % channels];
    row[size + i] = row[size - channels + i % channels];
  }
}

}  // namespace

void filter_rows(const RowSweep& sweep, const Taps& taps) {
  const std::size_t size = static_cast<std::size_t>(sweep.width) * sweep.channels;
  RowRing ring(sweep);
  std::vector<float> padded(size + 2 * kReach * sweep.channels), filtered(size);
  float* middle = padded.data() + kReach * sweep.channels;
  FiveRows shifted;
  for (int i = 0; i < static_cast<int>(shifted.size()); ++i) shifted[i] = middle + (i - kReach) * sweep.channels;
  for (int v = 0; v < sweep.height; ++v) {
    blend(ring.around(v), taps, size, middle);
    repeat_ends(middle, size, sweep.channels);
    blend(shifted, taps, size, filtered.data());
    sweep.output(v, filtered.data());
  }
}

Plane smooth(const Image& image) {
  Plane smoothed(image.width, image.height);
  const auto input = [&](int v, float* row) {
    to_float(&image.pixels[v * smoothed.row_size()], smoothed.row_size(), row);
  };
  const auto output = [&](int v, const float* row) { std::copy_n(row, smoothed.row_size(), smoothed.row(v)); };
  filter_rows({image.width, image.height, 1, input, output}, kBinomial);
  return smoothed;
}

Plane corner_response(const Plane& smoothed) {
  Plane response(smoothed.width, smoothed.height);
  Gradients gradients(smoothed);
  const auto input = [&](int v, float* row) {
    gradients.load(v);
    tensor_row(gradients.du.data(), gradients.dv.data(), gradients.du.size(), row);
  };
  const auto output = [&](int v, const float* row) { response_row(row, response.row_size(), response.row(v)); };
  filter_rows({smoothed.width, smoothed.height, 3, input, output}, kWide);
  return response;
}

Plane gradient_directions(const Plane& smoothed) {
  Plane directions(smoothed.width / 2, smoothed.height / 2, kDirections);
  Gradients gradients(smoothed);
  const auto input = [&](int cell_row, float* row) {
    std::fill_n(row, directions.row_size(), 0.0F);
    for (const int v : {2 * cell_row, 2 * cell_row + 1}) {
      gradients.load(v);
      add_directions(gradients.du.data(), gradients.dv.data(), directions.width, row);
    }
  };
  const auto output = [&](int v, const float* row) { std::copy_n(row, directions.row_size(), directions.row(v)); };
  filter_rows({directions.width, directions.height, kDirections, input, output}, kTriangle);
  return directions;
}

}  // namespace demslam
