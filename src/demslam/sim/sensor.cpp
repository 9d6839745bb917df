#include "demslam/sim/sensor.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "demslam/base/random.h"

namespace demslam {
namespace {

/// Approximately normal (sum of four uniforms of 16 bits, variance 1), one hash per pixel.
float quick_normal(std::uint64_t word) {
  const std::uint64_t bits = Random::mix(word);
  const std::uint64_t sum = (bits & 0xffff) + ((bits >> 16) & 0xffff) + ((bits >> 32) & 0xffff) + (bits >> 48);
  constexpr float kScale = 1.7320508F / 65536.0F;  // the sum's variance is 4 / 12 in units of 65536
  return (static_cast<float>(sum) - 131070.0F) * kScale;
}

std::vector<float> gaussian_kernel(double sigma) {
  const int radius = static_cast<int>(std::ceil(3.0 * sigma));
  std::vector<float> kernel;
  float sum = 0.0F;
  for (int i = -radius; i <= radius; ++i) {
    kernel.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sigma * sigma))));
    sum += kernel.back();
  }
  for (float& weight : kernel) weight /= sum;
  return kernel;
}

/// out += weight * in
void add_row(const float* in, float weight, float* out, int count) {
  for (int i = 0; i < count; ++i) out[i] += weight * in[i];
}

/// Blurs along the rows, edges repeated.
void blur_rows(const std::vector<float>& from, std::vector<float>& to, int width, int height,
               const std::vector<float>& kernel) {
  const int taps = static_cast<int>(kernel.size()), radius = taps / 2;
  tbb::parallel_for(0, height, [&](int v) {
    const float* in = from.data() + static_cast<std::size_t>(v) * width;
    std::vector<float> padded(static_cast<std::size_t>(width) + taps);
    for (int u = -radius; u < width + radius; ++u) padded[u + radius] = in[std::clamp(u, 0, width - 1)];
    for (int k = 0; k < taps; ++k)
      add_row(padded.data() + k, kernel[k], to.data() + static_cast<std::size_t>(v) * width, width);
  });
}

/// Blurs along the columns, edges repeated.
void blur_columns(const std::vector<float>& from, std::vector<float>& to, int width, int height,
                  const std::vector<float>& kernel) {
  const int taps = static_cast<int>(kernel.size()), radius = taps / 2;
  tbb::parallel_for(0, height, [&](int v) {
    for (int k = 0; k < taps; ++k) {
      const int row = std::clamp(v + k - radius, 0, height - 1);
      add_row(from.data() + static_cast<std::size_t>(row) * width, kernel[k],
              to.data() + static_cast<std::size_t>(v) * width, width);
    }
  });
}

std::vector<float> blurred(const Rendering& rendering, double sigma_px) {
  if (sigma_px <= 0.0) return rendering.radiance;
  const std::vector<float> kernel = gaussian_kernel(sigma_px);
  std::vector<float> half(rendering.radiance.size(), 0.0F), full(rendering.radiance.size(), 0.0F);
  blur_rows(rendering.radiance, half, rendering.width, rendering.height, kernel);
  blur_columns(half, full, rendering.width, rendering.height, kernel);
  return full;
}

/// Share of the light that a pixel gets: 1 in the middle, 1 - loss in the corners.
struct Vignette {
  Vignette(const Rendering& image, double loss)
      : middle_u(0.5F * static_cast<float>(image.width - 1)),
        middle_v(0.5F * static_cast<float>(image.height - 1)),
        slope(static_cast<float>(loss) / (middle_u * middle_u + middle_v * middle_v)) {}

  float operator()(int u, int v) const {
    const float du = static_cast<float>(u) - middle_u, dv = static_cast<float>(v) - middle_v;
    return 1.0F - slope * (du * du + dv * dv);
  }

  float middle_u, middle_v, slope;
};

/// Light (1 = white) to grey value.
struct Electronics {
  explicit Electronics(const CameraOptions& camera)
      : full_well(static_cast<float>(camera.full_well_e)),
        read_noise(static_cast<float>(camera.read_noise_e)),
        inverse_gamma(static_cast<float>(1.0 / camera.gamma)),
        white(static_cast<float>((1 << camera.bits) - 1)) {}

  std::uint16_t grey(float light, std::uint64_t noise_word) const {
    if (full_well > 0.0F) {
      const float electrons = light * full_well;
      light = (electrons + std::sqrt(electrons + read_noise * read_noise) * quick_normal(noise_word)) / full_well;
    }
    const float clipped = std::clamp(light, 0.0F, 1.0F);
    const float encoded = inverse_gamma == 0.5F ? std::sqrt(clipped) : std::pow(clipped, inverse_gamma);
    return static_cast<std::uint16_t>(white * encoded + 0.5F);
  }

  float full_well, read_noise, inverse_gamma, white;
};

/// Grains on the window before the lens are far out of focus: soft grey discs of 0.4 to 2 % of the image's width that
/// take 5 to 35 % of the light.
void add_dust(std::vector<float>& light, int width, int height, int spots, std::uint64_t window_key) {
  Random random(window_key, 0x64757374);
  for (int k = 0; k < spots; ++k) {
    const double middle_u = random.uniform() * width, middle_v = random.uniform() * height;
    const double radius = std::max(1.5, width * random.uniform(0.004, 0.02)), loss = random.uniform(0.05, 0.35);
    const int first_v = std::max(0, static_cast<int>(middle_v - radius)),
              last_v = std::min(height - 1, static_cast<int>(middle_v + radius));
    const int first_u = std::max(0, static_cast<int>(middle_u - radius)),
              last_u = std::min(width - 1, static_cast<int>(middle_u + radius));
    for (int v = first_v; v <= last_v; ++v) {
      for (int u = first_u; u <= last_u; ++u) {
        const double r2 = (std::pow(u - middle_u, 2) + std::pow(v - middle_v, 2)) / (radius * radius);
        if (r2 < 1.0)
          light[static_cast<std::size_t>(v) * width + u] *= static_cast<float>(1.0 - loss * (1.0 - r2 * r2));
      }
    }
  }
}

}  // namespace

Image Levels::upper_byte() const {
  Image image(width, height);
  for (std::size_t i = 0; i < values.size(); ++i) image.pixels[i] = static_cast<std::uint8_t>(values[i] >> (bits - 8));
  return image;
}

std::vector<std::uint16_t> Levels::aligned() const {
  std::vector<std::uint16_t> result = values;
  for (std::uint16_t& value : result) value = static_cast<std::uint16_t>(value << (16 - bits));
  return result;
}

double automatic_exposure(const Rendering& rendering) {
  std::vector<float> lit;
  for (const float value : rendering.radiance) {
    if (value > 0.0F) lit.push_back(value);
  }
  if (lit.empty()) return 1.0;
  const auto at = lit.begin() + static_cast<std::ptrdiff_t>(0.98 * static_cast<double>(lit.size() - 1));
  std::nth_element(lit.begin(), at, lit.end());
  return 0.8 / *at;
}

Levels develop(const Rendering& rendering, const CameraOptions& camera, double exposure, std::uint64_t noise_key,
               std::uint64_t window_key) {
  std::vector<float> light = blurred(rendering, camera.blur_px);
  add_dust(light, rendering.width, rendering.height, camera.dust_spots, window_key);
  const Electronics electronics(camera);
  const Vignette vignette(rendering, camera.vignetting);
  Levels levels{rendering.width, rendering.height, camera.bits, std::vector<std::uint16_t>(light.size())};
  tbb::parallel_for(0, rendering.height, [&](int v) {
    for (int u = 0; u < rendering.width; ++u) {
      const std::size_t i = static_cast<std::size_t>(v) * rendering.width + u;
      const float exposed = static_cast<float>(exposure) * vignette(u, v) * light[i];
      levels.values[i] = electronics.grey(exposed, noise_key + i * 0x9e3779b97f4a7c15ULL);
    }
  });
  return levels;
}

}  // namespace demslam
