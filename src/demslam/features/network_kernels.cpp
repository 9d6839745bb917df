// No Eigen here: these functions are compiled for several instruction sets (docs/architecture.md, "Eigen's ABI").
#include "demslam/features/network_kernels.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "demslam/features/vector_clones.h"

namespace demslam::nn {
namespace {

#define DEMSLAM_INLINE inline __attribute__((always_inline))

// Vectors are written out: sums then have one order on every processor. They are passed by reference, because how they
// are passed by value depends on the instruction set.
constexpr std::size_t kLanes = 16;
using Lanes = float __attribute__((vector_size(kLanes * sizeof(float))));
using IntLanes = std::int32_t __attribute__((vector_size(kLanes * sizeof(std::int32_t))));
using ShortLanes = std::uint16_t __attribute__((vector_size(kLanes * sizeof(std::uint16_t))));

/// exp to 2 units in the last place: exp(n ln 2 + r), |r| <= ln(2) / 2, by the Taylor series of r; 0 below -87.
DEMSLAM_INLINE void exp_of(const Lanes& x, Lanes& result) {
  constexpr float kLowest = -87.0F, kHighest = 88.0F, kRound = 12582912.0F;  // 1.5 * 2^23: adding it rounds
  const IntLanes too_low = x < kLowest;
  Lanes bounded = x > kHighest ? Lanes{} + kHighest : x;
  bounded = too_low ? Lanes{} + kLowest : bounded;
  const Lanes shifted = bounded * 1.44269504F + kRound, n = shifted - kRound;
  const Lanes r = (bounded - n * 0.693359375F) + n * 2.12194440e-4F;  // ln 2 in two parts
  Lanes series = r * (1.0F / 720.0F) + 1.0F / 120.0F;
  series = series * r + 1.0F / 24.0F;
  series = series * r + 1.0F / 6.0F;
  series = series * r + 0.5F;
  series = series * r + 1.0F;
  series = series * r + 1.0F;
  const IntLanes bits = (IntLanes)series + ((IntLanes)shifted << 23);
  result = too_low ? Lanes{} : (Lanes)bits;
}

/// The bfloat16 nearest to exp(x), with an error of 8e-5 of its value besides the rounding: 2^n times a cubic (Remez's)
/// in f, |f| <= 1/2. For x not above zero; below -87 counts as -87.
DEMSLAM_INLINE void rounded_exp_of(const Lanes& x, IntLanes& result) {
  constexpr float kLowest = -125.5F, kRound = 12582912.0F;
  Lanes power = x * 1.44269504F;
  power = power > kLowest ? power : Lanes{} + kLowest;
  const Lanes shifted = power + kRound, f = power - (shifted - kRound);
  Lanes series = f * 0.055171669F + 0.242611122F;
  series = series * f + 0.693260985F;
  series = series * f + 0.999928074F;
  result = (IntLanes)series + ((IntLanes)shifted << 23) + 0x8000;
}

/// erf to 2e-7 (Abramowitz and Stegun 7.1.26).
DEMSLAM_INLINE void erf_of(const Lanes& x, Lanes& result) {
  const Lanes magnitude = x < 0.0F ? -x : x, t = 1.0F / (1.0F + 0.3275911F * magnitude);
  Lanes series = 1.061405429F * t - 1.453152027F;
  series = series * t + 1.421413741F;
  series = series * t - 0.284496736F;
  series = series * t + 0.254829592F;
  Lanes fall;
  exp_of(-magnitude * magnitude, fall);
  result = 1.0F - series * t * fall;
  result = x < 0.0F ? -result : result;
}

DEMSLAM_INLINE void sigmoid_of(const Lanes& x, Lanes& result) {
  exp_of(-x, result);
  result = 1.0F / (1.0F + result);
}

DEMSLAM_INLINE void gelu_of(const Lanes& x, Lanes& result) {
  erf_of(x * 0.707106781F, result);
  result = 0.5F * x * (1.0F + result);
}

/// Up to kLanes values; the lanes behind them are zero.
DEMSLAM_INLINE void load(const float* in, std::size_t count, Lanes& lanes) {
  lanes = Lanes{};
  std::memcpy(&lanes, in, std::min(count, kLanes) * sizeof(float));
}

DEMSLAM_INLINE void store(const Lanes& lanes, std::size_t count, float* out) {
  std::memcpy(out, &lanes, std::min(count, kLanes) * sizeof(float));
}

/// Always in the same order.
DEMSLAM_INLINE float sum_of(const Lanes& lanes) {
  float total = 0.0F;
  for (std::size_t i = 0; i < kLanes; ++i) total += lanes[i];
  return total;
}

#define DEMSLAM_IN_LANES(name, function)                                            \
  DEMSLAM_VECTOR_CLONES void name(const float* in, std::size_t count, float* out) { \
    Lanes x, y;                                                                     \
    std::size_t i = 0;                                                              \
    for (; i + kLanes <= count; i += kLanes) {                                      \
      std::memcpy(&x, in + i, sizeof x);                                            \
      function(x, y);                                                               \
      std::memcpy(out + i, &y, sizeof y);                                           \
    }                                                                               \
    load(in + i, count - i, x);                                                     \
    function(x, y);                                                                 \
    store(y, count - i, out + i);                                                   \
  }
DEMSLAM_IN_LANES(sigmoid_all, sigmoid_of)
DEMSLAM_IN_LANES(exp_all, exp_of)
DEMSLAM_IN_LANES(gelu_all, gelu_of)
DEMSLAM_IN_LANES(erf_all, erf_of)
#undef DEMSLAM_IN_LANES

#define DEMSLAM_UNARY(name, expression)                                             \
  DEMSLAM_VECTOR_CLONES void name(const float* in, std::size_t count, float* out) { \
    for (std::size_t i = 0; i < count; ++i) {                                       \
      const float x = in[i];                                                        \
      out[i] = expression;                                                          \
    }                                                                               \
  }
DEMSLAM_UNARY(relu_all, x > 0.0F ? x : 0.0F)
DEMSLAM_UNARY(sqrt_all, __builtin_sqrtf(x))
DEMSLAM_UNARY(negate_all, -x)
DEMSLAM_UNARY(reciprocal_all, 1.0F / x)
DEMSLAM_UNARY(abs_all, __builtin_fabsf(x))

#define DEMSLAM_BINARY(name, expression)                                                                             \
  DEMSLAM_VECTOR_CLONES void name##_both(const float* a, const float* b, std::size_t count, float* out) {            \
    for (std::size_t i = 0; i < count; ++i) {                                                                        \
      const float x = a[i], y = b[i];                                                                                \
      out[i] = expression;                                                                                           \
    }                                                                                                                \
  }                                                                                                                  \
  DEMSLAM_VECTOR_CLONES void name##_left(const float* a, float y, std::size_t count, float* out) {                   \
    for (std::size_t i = 0; i < count; ++i) {                                                                        \
      const float x = a[i];                                                                                          \
      out[i] = expression;                                                                                           \
    }                                                                                                                \
  }                                                                                                                  \
  DEMSLAM_VECTOR_CLONES void name##_right(float x, const float* b, std::size_t count, float* out) {                  \
    for (std::size_t i = 0; i < count; ++i) {                                                                        \
      const float y = b[i];                                                                                          \
      out[i] = expression;                                                                                           \
    }                                                                                                                \
  }                                                                                                                  \
  void name(const float* a, std::size_t a_step, const float* b, std::size_t b_step, std::size_t count, float* out) { \
    if (a_step != 0 && b_step != 0) return name##_both(a, b, count, out);                                            \
    if (a_step != 0) return name##_left(a, *b, count, out);                                                          \
    if (b_step != 0) return name##_right(*a, b, count, out);                                                         \
    const float x = *a, y = *b;                                                                                      \
    for (std::size_t i = 0; i < count; ++i) out[i] = expression;                                                     \
  }
DEMSLAM_BINARY(add_all, x + y)
DEMSLAM_BINARY(subtract_all, x - y)
DEMSLAM_BINARY(multiply_all, x* y)
DEMSLAM_BINARY(divide_all, x / y)
DEMSLAM_BINARY(maximum_all, x > y ? x : y)
DEMSLAM_BINARY(minimum_all, x < y ? x : y)

#undef DEMSLAM_UNARY
#undef DEMSLAM_BINARY

}  // namespace

DEMSLAM_VECTOR_CLONES void floats_to_bf16(const float* in, std::size_t count, std::uint16_t* out) {
  for (std::size_t i = 0; i < count; ++i) {
    const auto bits = std::bit_cast<std::uint32_t>(in[i]);
    const std::uint32_t nearest = (bits + 0x7FFFU + ((bits >> 16U) & 1U)) >> 16U;
    const std::uint32_t nan = (bits & 0x7FFFFFFFU) > 0x7F800000U ? 0xFFFFFFFFU : 0U;
    out[i] = static_cast<std::uint16_t>((nearest & ~nan) | (0x7FC0U & nan));
  }
}

DEMSLAM_VECTOR_CLONES void bf16_to_floats(const std::uint16_t* in, std::size_t count, float* out) {
  for (std::size_t i = 0; i < count; ++i) out[i] = std::bit_cast<float>(static_cast<std::uint32_t>(in[i]) << 16U);
}

void apply(Unary function, const float* in, std::size_t count, float* out) {
  switch (function) {
    case Unary::relu:
      return relu_all(in, count, out);
    case Unary::sigmoid:
      return sigmoid_all(in, count, out);
    case Unary::exp:
      return exp_all(in, count, out);
    case Unary::gelu:
      return gelu_all(in, count, out);
    case Unary::erf:
      return erf_all(in, count, out);
    case Unary::sqrt:
      return sqrt_all(in, count, out);
    case Unary::negate:
      return negate_all(in, count, out);
    case Unary::reciprocal:
      return reciprocal_all(in, count, out);
    case Unary::abs:
      return abs_all(in, count, out);
  }
}

void apply(Binary function, const float* a, std::size_t a_step, const float* b, std::size_t b_step, std::size_t count,
           float* out) {
  switch (function) {
    case Binary::add:
      return add_all(a, a_step, b, b_step, count, out);
    case Binary::subtract:
      return subtract_all(a, a_step, b, b_step, count, out);
    case Binary::multiply:
      return multiply_all(a, a_step, b, b_step, count, out);
    case Binary::divide:
      return divide_all(a, a_step, b, b_step, count, out);
    case Binary::maximum:
      return maximum_all(a, a_step, b, b_step, count, out);
    case Binary::minimum:
      return minimum_all(a, a_step, b, b_step, count, out);
  }
}

DEMSLAM_VECTOR_CLONES float largest(const float* in, std::size_t count) {
  Lanes most = Lanes{} - INFINITY, x;
  std::size_t i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    std::memcpy(&x, in + i, sizeof x);
    most = x > most ? x : most;
  }
  float result = -INFINITY;
  for (std::size_t k = 0; k < kLanes; ++k) result = most[k] > result ? most[k] : result;
  for (; i < count; ++i) result = in[i] > result ? in[i] : result;
  return result;
}

DEMSLAM_VECTOR_CLONES float shifted_exp(const float* in, float shift, std::size_t count, float* out) {
  Lanes x, y, total = {};
  std::size_t i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    std::memcpy(&x, in + i, sizeof x);
    exp_of(x - shift, y);
    total += y;
    std::memcpy(out + i, &y, sizeof y);
  }
  load(in + i, count - i, x);
  exp_of(x - shift, y);
  store(y, count - i, out + i);
  load(out + i, count - i, y);  // without the lanes behind the end
  return sum_of(total + y);
}

DEMSLAM_VECTOR_CLONES float shifted_exp(const float* in, float shift, std::size_t count, std::uint16_t* out) {
  constexpr std::int32_t kUpperHalf = ~0xFFFF;
  Lanes x, total = {};
  IntLanes y;
  std::size_t i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    std::memcpy(&x, in + i, sizeof x);
    rounded_exp_of(x - shift, y);
    const ShortLanes halves = __builtin_convertvector(y >> 16, ShortLanes);
    std::memcpy(out + i, &halves, sizeof halves);
    total += (Lanes)(y & kUpperHalf);
  }
  load(in + i, count - i, x);
  rounded_exp_of(x - shift, y);
  for (std::size_t k = 0; i + k < count; ++k) {
    out[i + k] = static_cast<std::uint16_t>(y[k] >> 16);
    total[k] += std::bit_cast<float>(y[k] & kUpperHalf);
  }
  return sum_of(total);
}

DEMSLAM_VECTOR_CLONES std::int64_t place_of_largest(const float* in, std::size_t count) {
  Lanes x, most = Lanes{} - INFINITY;
  IntLanes at = IntLanes{} - 1, place = at;
  for (std::size_t k = 0; k < kLanes; ++k) at[k] = static_cast<std::int32_t>(k);
  std::size_t i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    std::memcpy(&x, in + i, sizeof x);
    const IntLanes better = x > most;
    most = better ? x : most;
    place = better ? at : place;
    at += static_cast<std::int32_t>(kLanes);
  }
  float best = -INFINITY;
  std::int32_t found = 0;
  for (std::size_t k = 0; k < kLanes; ++k) {
    const bool first_of_equals = most[k] == best && place[k] < found;
    if (place[k] < 0 || !(most[k] > best || first_of_equals)) continue;
    best = most[k];
    found = place[k];
  }
  for (; i < count; ++i) {
    if (in[i] > best) best = in[i], found = static_cast<std::int32_t>(i);
  }
  return found;
}

DEMSLAM_VECTOR_CLONES void update_best(const float* in, std::int32_t row, std::size_t count, float* best,
                                       std::int32_t* place) {
  for (std::size_t i = 0; i < count; ++i) {
    place[i] = in[i] > best[i] ? row : place[i];
    best[i] = in[i] > best[i] ? in[i] : best[i];
  }
}

DEMSLAM_VECTOR_CLONES float sum(const float* in, std::size_t count) {
  Lanes x, total = {};
  std::size_t i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    std::memcpy(&x, in + i, sizeof x);
    total += x;
  }
  load(in + i, count - i, x);
  return sum_of(total + x);
}

DEMSLAM_VECTOR_CLONES float sum_of_squares(const float* in, float shift, std::size_t count) {
  Lanes x, total = {};
  std::size_t i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    std::memcpy(&x, in + i, sizeof x);
    x -= shift;
    total += x * x;
  }
  float result = sum_of(total);
  for (; i < count; ++i) result += (in[i] - shift) * (in[i] - shift);
  return result;
}

DEMSLAM_VECTOR_CLONES void normalise(const float* in, float mean, float scale, const float* weight, const float* bias,
                                     std::size_t count, float* out) {
  for (std::size_t i = 0; i < count; ++i) out[i] = (in[i] - mean) * scale * weight[i] + bias[i];
}

DEMSLAM_VECTOR_CLONES void scale(const float* in, float factor, std::size_t count, float* out) {
  for (std::size_t i = 0; i < count; ++i) out[i] = in[i] * factor;
}

DEMSLAM_VECTOR_CLONES void blend(const float* a, const float* b, float t, std::size_t count, float* out) {
  const float rest = 1.0F - t;
  for (std::size_t i = 0; i < count; ++i) out[i] = rest * a[i] + t * b[i];
}

/// Four results at a time share the loading of a weight.
DEMSLAM_VECTOR_CLONES void convolve(const FewInputs& few, std::size_t count, float* out) {
  constexpr std::size_t kTogether = 4;
  const std::size_t padded = (few.channels + kLanes - 1) / kLanes * kLanes;
  for (std::size_t i = 0; i < count; i += kTogether) {
    std::size_t at[kTogether];
    for (std::size_t j = 0; j < kTogether; ++j) at[j] = std::min(i + j, count - 1) * few.step;
    for (std::size_t c = 0; c < padded; c += kLanes) {
      Lanes weight, sum[kTogether];
      std::memcpy(&weight, few.bias + c, sizeof weight);
#pragma GCC unroll 4
      for (std::size_t j = 0; j < kTogether; ++j) sum[j] = weight;
      const float* weights = few.weights + c;
      for (std::size_t r = 0; r < few.row_count; ++r) {
        for (std::size_t k = 0; k < few.width; ++k, weights += padded) {
          std::memcpy(&weight, weights, sizeof weight);
#pragma GCC unroll 4
          for (std::size_t j = 0; j < kTogether; ++j) sum[j] += weight * few.rows[r][at[j] + k];
        }
      }
      const std::size_t some = std::min(kLanes, few.channels - c);
      for (std::size_t j = 0; j < kTogether && i + j < count; ++j) {
        if (few.relu) sum[j] = sum[j] > 0.0F ? sum[j] : Lanes{};
        std::memcpy(out + (i + j) * few.channels + c, &sum[j], some * sizeof(float));
      }
    }
  }
}

DEMSLAM_VECTOR_CLONES void add_shifted_exp(const float* in, const float* shift, std::size_t count, float* sum) {
  Lanes x, low, y;
  std::size_t i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    std::memcpy(&x, in + i, sizeof x);
    std::memcpy(&low, shift + i, sizeof low);
    exp_of(x - low, y);
    std::memcpy(&low, sum + i, sizeof low);
    y += low;
    std::memcpy(sum + i, &y, sizeof y);
  }
  load(in + i, count - i, x);
  load(shift + i, count - i, low);
  exp_of(x - low, y);
  load(sum + i, count - i, low);
  store(low + y, count - i, sum + i);
}

void softmax(const float* in, std::size_t count, float* out) {
  const float total = shifted_exp(in, largest(in, count), count, out);
  scale(out, 1.0F / total, count, out);
}

}  // namespace demslam::nn
