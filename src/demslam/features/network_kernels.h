#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

namespace demslam::nn {

/// Nearest bfloat16, ties to even; infinities stay, a NaN stays one.
inline std::uint16_t to_bf16(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  const std::uint32_t rounded = (bits + 0x7FFFU + ((bits >> 16U) & 1U)) >> 16U;
  return static_cast<std::uint16_t>((bits & 0x7FFFFFFFU) > 0x7F800000U ? 0x7FC0U : rounded);
}

// Everything below runs over `count` values side by side and gives the same bits on every processor; `in` and `out` may
// be the same.
void floats_to_bf16(const float* in, std::size_t count, std::uint16_t* out);
void bf16_to_floats(const std::uint16_t* in, std::size_t count, float* out);

enum class Unary { relu, sigmoid, exp, gelu, erf, sqrt, negate, reciprocal, abs };
void apply(Unary function, const float* in, std::size_t count, float* out);

enum class Binary { add, subtract, multiply, divide, maximum, minimum };
/// Steps of a and b are 1 or, for one value throughout, 0.
void apply(Binary function, const float* a, std::size_t a_step, const float* b, std::size_t b_step, std::size_t count,
           float* out);

float largest(const float* in, std::size_t count);
/// exp(in - shift), and the sum of it.
float shifted_exp(const float* in, float shift, std::size_t count, float* out);
/// The same as bfloat16, to its precision; the sum is that of what is stored. Nothing may exceed the shift.
float shifted_exp(const float* in, float shift, std::size_t count, std::uint16_t* out);
/// exp(in) by the sum of all.
void softmax(const float* in, std::size_t count, float* out);
/// Place of the largest value, the first of equal ones.
std::int64_t place_of_largest(const float* in, std::size_t count);
/// Column by column: where a value exceeds the best so far, it becomes the best and `row` its place.
void update_best(const float* in, std::int32_t row, std::size_t count, float* best, std::int32_t* place);
float sum(const float* in, std::size_t count);
float sum_of_squares(const float* in, float shift, std::size_t count);

/// (in - mean) * scale * weight + bias.
void normalise(const float* in, float mean, float scale, const float* weight, const float* bias, std::size_t count,
               float* out);
/// out = (1 - t) a + t b.
void blend(const float* a, const float* b, float t, std::size_t count, float* out);
/// A convolution that reads few values: `count` results of `channels` values each, side by side, result i being bias +
/// the sum over rows r and k < width of rows[r][i * step + k] * weights[(r * width + k) * padded(channels) + channel];
/// weights and bias are padded to multiples of 16 channels.
struct FewInputs {
  const float* const* rows;
  std::size_t row_count, width, step, channels;
  const float *weights, *bias;
  bool relu;
};
void convolve(const FewInputs& few, std::size_t count, float* out);
/// out = in * scale.
void scale(const float* in, float factor, std::size_t count, float* out);
/// sum += exp(in - shift), value by value.
void add_shifted_exp(const float* in, const float* shift, std::size_t count, float* sum);

}  // namespace demslam::nn
