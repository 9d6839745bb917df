#pragma once

#include <map>
#include <memory>

#include "demslam/features/network_engine.h"

namespace demslam::nn {

/// Where a window of rows x columns stands as it moves over an image.
struct Window {
  Dims kernel{1, 1}, strides{1, 1}, dilations{1, 1};
  Dims pads{0, 0, 0, 0};  ///< top, left, bottom, right

  /// Rows (axis 0) or columns (axis 1) of the result.
  std::int64_t result_size(std::int64_t size, int axis) const;
};

/// 2-D convolution of images [N,C,H,W] with constant weights, through oneDNN; channels lie side by side within.
class Convolution {
 public:
  /// Weights [O, C / groups, rows, columns], float; bias [O] or empty. `relu`: negative results become zero.
  Convolution(Engine& engine, const Array& weights, const Array& bias, const Window& window, std::int64_t groups,
              bool relu);
  ~Convolution();

  Array run(Engine& engine, const Array& images, Type result) const;

 private:
  struct Band;
  struct Primitive;
  std::int64_t bands_for(const Dims& result) const;
  Band band(const Dims& images, const Dims& result, std::int64_t index, std::int64_t count) const;
  const Primitive& primitive_for(Engine& engine, const Band& band, Type factors, Type result) const;
  /// The fastest implementation that gives right numbers. Throws Error when none does.
  Primitive make(Engine& engine, const Band& band, Type factors, Type result) const;
  void execute(const Primitive& primitive, const std::byte* from, const std::byte* to) const;
  /// A value of the result by plain arithmetic from dense floats (image: channels side by side), and the sum of its
  /// terms' sizes.
  struct Plain {
    double value = 0.0, size = 0.0;
  };
  Plain plainly(const float* image, const float* weights, const Band& band, std::int64_t row, std::int64_t column,
                std::int64_t channel) const;
  bool is_right(Engine& engine, const Primitive& primitive, const Band& band, Type factors, Type result) const;

  Window window_;
  std::int64_t groups_;
  bool relu_;
  Array weights_, bias_;
  struct Made;
  std::unique_ptr<Made> made_;
};

/// The same where a result is made of so few values that a plain loop over them beats the library: the first layer of a
/// network that sees grey images. All in float.
class SmallConvolution {
 public:
  static bool suits(const Array& weights, const Window& window, std::int64_t groups);
  SmallConvolution(Engine& engine, const Array& weights, const Array& bias, const Window& window, bool relu);

  Array run(Engine& engine, const Array& images, Type result) const;

 private:
  Window window_;
  bool relu_;
  std::int64_t channels_;
  std::vector<float> weights_, bias_;
};

enum class Pooling { largest, average, average_with_padding };
/// Dilations are not heeded. The result has the type of the images, channels side by side.
Array pool_images(Engine& engine, Pooling kind, const Window& window, const Array& images);

/// Bilinear, pixel centres at half integers, borders repeated.
Array resize_images(Engine& engine, const Array& images, std::int64_t rows, std::int64_t columns);

}  // namespace demslam::nn
