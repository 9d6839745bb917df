#include "demslam/features/network_images.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <dnnl.hpp>

#include "demslam/base/error.h"
#include "demslam/base/random.h"
#include "demslam/features/internal/dnnl_support.h"
#include "demslam/features/network_kernels.h"

namespace demslam::nn {

using dnnl::memory;
using Tag = memory::format_tag;

std::int64_t Window::result_size(std::int64_t size, int axis) const {
  const std::int64_t reach = dilations[axis] * (kernel[axis] - 1) + 1;
  return (size + pads[axis] + pads[axis + 2] - reach) / strides[axis] + 1;
}

namespace {

Dims result_shape(const Window& window, const Dims& images, std::int64_t channels) {
  Dims shape{images[0], channels, window.result_size(images[2], 0), window.result_size(images[3], 1)};
  if (shape[2] < 1 || shape[3] < 1) throw Error("an image is too small for the network");
  return shape;
}

memory::desc image_desc(const Dims& shape, Type type) { return {shape, data_type(type), Tag::nhwc}; }

Dims first(const Dims& pads) { return {pads[0], pads[1]}; }
Dims last(const Dims& pads) { return {pads[2], pads[3]}; }

/// Channels side by side in the type of the images, float for all but bfloat16.
Array as_images(Engine& engine, const Array& images) {
  return as_channels_last(engine.pool(), images, images.type == Type::bf16 ? Type::bf16 : Type::f32);
}

/// Runs a primitive with one input and one output.
template <class Primitive>
Array run_simple(Engine& engine, const typename Primitive::primitive_desc& description, const Array& images,
                 const Dims& shape) {
  Array out = make_array(engine.pool(), images.type, shape, channels_last(shape));
  Primitive(description)
      .execute(stream(), {{DNNL_ARG_SRC, on_memory(description.src_desc(), images.start)},
                          {DNNL_ARG_DST, on_memory(description.dst_desc(), out.start)},
                          {DNNL_ARG_SCRATCHPAD, scratch_memory(description.scratchpad_desc())}});
  return out;
}

/// Channels side by side, of numbers that bfloat16 has exactly.
Array random_image(Pool& pool, const Dims& shape) {
  Array image = make_array(pool, Type::f32, shape, channels_last(shape));
  Random random(1);
  std::generate_n(image.data<float>(), image.count(),
                  [&] { return static_cast<float>(std::floor(random.uniform(-128.0, 128.0)) / 128.0); });
  return image;
}

}  // namespace

/// Rows of the result that are made at a time, and what they need of the image.
struct Convolution::Band {
  std::int64_t first_in = 0, first_out = 0;
  Dims in, out;  ///< shapes, one image each
  std::int64_t pad_above = 0, pad_below = 0;

  using Key = std::array<std::int64_t, 6>;
  Key key() const { return {in[2], in[3], out[2], out[3], pad_above, pad_below}; }
};

struct Convolution::Primitive {
  dnnl::convolution_forward primitive;
  memory::desc in, out, weights, bias, scratch;
  Array packed;
};

struct Convolution::Made {
  std::map<std::pair<Band::Key, Type>, Primitive> primitives;
};

Convolution::Convolution(Engine& engine, const Array& weights, const Array& bias, const Window& window,
                         std::int64_t groups, bool relu)
    : window_(window),
      groups_(groups),
      relu_(relu),
      weights_(as_row_major(engine.pool(), weights, Type::f32)),
      made_(std::make_unique<Made>()) {
  if (bias) bias_ = as_row_major(engine.pool(), bias, Type::f32);
}
Convolution::~Convolution() = default;

/// So that several threads can share an image; by the work alone, never by the number of threads.
std::int64_t Convolution::bands_for(const Dims& result) const {
  constexpr std::int64_t kProductsPerBand = 1 << 27, kMostBands = 8, kFewestRows = 8;
  const std::int64_t products = result[2] * result[3] * weights_.count();
  return std::clamp<std::int64_t>(products / kProductsPerBand, 1,
                                  std::clamp<std::int64_t>(result[2] / kFewestRows, 1, kMostBands));
}

Convolution::Band Convolution::band(const Dims& images, const Dims& result, std::int64_t index,
                                    std::int64_t count) const {
  Band band{.in = images, .out = result};
  const std::int64_t end = result[2] * (index + 1) / count;
  band.first_out = result[2] * index / count;
  const std::int64_t begin_in = band.first_out * window_.strides[0] - window_.pads[0];
  const std::int64_t end_in =
      (end - 1) * window_.strides[0] - window_.pads[0] + (window_.kernel[0] - 1) * window_.dilations[0] + 1;
  band.first_in = std::max<std::int64_t>(begin_in, 0);
  band.pad_above = band.first_in - begin_in;
  band.pad_below = std::max<std::int64_t>(end_in - images[2], 0);
  band.in[0] = band.out[0] = 1;
  band.in[2] = end_in - band.pad_below - band.first_in;
  band.out[2] = end - band.first_out;
  return band;
}

void Convolution::execute(const Primitive& p, const std::byte* from, const std::byte* to) const {
  std::unordered_map<int, memory> arguments{{DNNL_ARG_SRC, on_memory(p.in, from)},
                                            {DNNL_ARG_WEIGHTS, on_memory(p.weights, p.packed.start)},
                                            {DNNL_ARG_DST, on_memory(p.out, to)},
                                            {DNNL_ARG_SCRATCHPAD, scratch_memory(p.scratch)}};
  if (bias_) arguments.emplace(DNNL_ARG_BIAS, on_memory(p.bias, bias_.start));
  p.primitive.execute(stream(), arguments);
}

/// Asked of every implementation before it is used, of some pixels of a random image: oneDNN 3.7 has kernels for
/// AVX-512 that give wrong numbers where the channels are no multiple of 16.
bool Convolution::is_right(Engine& engine, const Primitive& primitive, const Band& band, Type factors,
                           Type result) const {
  Pool& pool = engine.pool();
  const Array image = random_image(pool, band.in), in = as_channels_last(pool, image, factors);
  const Array weights = as_row_major(pool, as_row_major(pool, weights_, factors), Type::f32);
  const Array out = make_array(pool, result, band.out, channels_last(band.out));
  execute(primitive, in.start, out.start);
  const Array made = as_channels_last(pool, out, Type::f32);
  const std::int64_t rows = band.out[2], columns = band.out[3], channels = band.out[1];
  for (const std::int64_t row : {std::int64_t{0}, rows / 2, rows - 1}) {
    for (const std::int64_t column : {std::int64_t{0}, columns / 3, columns / 2, columns - 1}) {
      for (std::int64_t channel = 0; channel < channels; ++channel) {
        const Plain plain = plainly(image.data<float>(), weights.data<float>(), band, row, column, channel);
        const double rounding = result == Type::bf16 ? 8e-3 * std::abs(plain.value) : 0.0;
        const double deviation = made.data<float>()[(row * columns + column) * channels + channel] - plain.value;
        if (!(std::abs(deviation) < rounding + 1e-4 * plain.size + 1e-6)) return false;
      }
    }
  }
  return true;
}

Convolution::Plain Convolution::plainly(const float* image, const float* weights, const Band& band, std::int64_t row,
                                        std::int64_t column, std::int64_t channel) const {
  const Dims& w = weights_.shape;
  const std::int64_t first_channel = channel / (w[0] / groups_) * w[1];
  Plain sum;
  if (bias_) sum.value = bias_.data<float>()[channel];
  sum.size = std::abs(sum.value);
  for (std::int64_t i = 0; i < w[1] * w[2] * w[3]; ++i) {
    const std::int64_t in_channel = first_channel + i / (w[2] * w[3]), down = i / w[3] % w[2], across = i % w[3];
    const std::int64_t y = row * window_.strides[0] - band.pad_above + down * window_.dilations[0];
    const std::int64_t x = column * window_.strides[1] - window_.pads[1] + across * window_.dilations[1];
    if (y < 0 || x < 0 || y >= band.in[2] || x >= band.in[3]) continue;
    const double product = static_cast<double>(image[(y * band.in[3] + x) * band.in[1] + in_channel]) *
                           weights[channel * w[1] * w[2] * w[3] + i];
    sum.value += product;
    sum.size += std::abs(product);
  }
  if (relu_) sum.value = std::max(sum.value, 0.0);
  return sum;
}

Convolution::Primitive Convolution::make(Engine& engine, const Band& band, Type factors, Type result) const {
  const Dims& w = weights_.shape;
  const Dims grouped{groups_, w[0] / groups_, w[1], w[2], w[3]};
  const memory::dims weight_dims = groups_ == 1 ? w : grouped;
  const memory::desc weights(weight_dims, data_type(factors), Tag::any);
  const memory::desc bias(memory::dims{w[0]}, memory::data_type::f32, Tag::a);
  dnnl::primitive_attr attributes = own_scratch();
  dnnl::post_ops after;
  if (relu_) after.append_eltwise(dnnl::algorithm::eltwise_relu, 0.0F, 0.0F);
  attributes.set_post_ops(after);
  const Dims dilations{window_.dilations[0] - 1, window_.dilations[1] - 1};
  const Dims above{band.pad_above, window_.pads[1]}, below{band.pad_below, window_.pads[3]};
  const auto forward = dnnl::prop_kind::forward_inference;
  const auto direct = dnnl::algorithm::convolution_direct;
  const memory::desc in = image_desc(band.in, factors), out = image_desc(band.out, result);
  dnnl::convolution_forward::primitive_desc description =
      bias_ ? dnnl::convolution_forward::primitive_desc(cpu(), forward, direct, in, weights, bias, out, window_.strides,
                                                        dilations, above, below, attributes)
            : dnnl::convolution_forward::primitive_desc(cpu(), forward, direct, in, weights, out, window_.strides,
                                                        dilations, above, below, attributes);
  const memory::desc plain(weight_dims, memory::data_type::f32, groups_ == 1 ? Tag::abcd : Tag::abcde);
  do {
    Primitive primitive{dnnl::convolution_forward(description),
                        in,
                        out,
                        description.weights_desc(),
                        bias,
                        description.scratchpad_desc(),
                        reordered(engine.pool(), weights_, plain, description.weights_desc())};
    if (is_right(engine, primitive, band, factors, result)) return primitive;
  } while (description.next_impl());
  throw Error("oneDNN multiplies wrongly on this processor; run the networks with --inference onnxruntime");
}

const Convolution::Primitive& Convolution::primitive_for(Engine& engine, const Band& band, Type factors,
                                                         Type result) const {
  const auto key = std::pair(band.key(), result);
  const auto found = made_->primitives.find(key);
  if (found != made_->primitives.end()) return found->second;
  return made_->primitives.emplace(key, make(engine, band, factors, result)).first->second;
}

Array Convolution::run(Engine& engine, const Array& images, Type result) const {
  const Type factors = engine.factor_type();
  const Array in = as_channels_last(engine.pool(), images, factors);
  const Dims shape = result_shape(window_, in.shape, weights_.shape[0]);
  Array out = make_array(engine.pool(), result, shape, channels_last(shape));
  const std::int64_t bands = bands_for(shape);
  std::vector<std::pair<Band, const Primitive*>> parts;
  for (std::int64_t i = 0; i < bands; ++i) {
    const Band part = band(in.shape, shape, i, bands);
    parts.emplace_back(part, &primitive_for(engine, part, factors, result));
  }
  engine.parallel(shape[0] * bands, [&](std::int64_t i) {
    const auto& [part, p] = parts[i % bands];
    const std::int64_t image = i / bands;
    const std::byte* from = in.start + (image * in.strides[0] + part.first_in * in.strides[2]) *
                                           static_cast<std::int64_t>(size_of(factors));
    const std::byte* to = out.start + (image * out.strides[0] + part.first_out * out.strides[2]) *
                                          static_cast<std::int64_t>(size_of(result));
    execute(*p, from, to);
  });
  return out;
}

Array pool_images(Engine& engine, Pooling kind, const Window& window, const Array& images) {
  const Array in = as_images(engine, images);
  const Dims shape = result_shape(window, in.shape, in.shape[1]);
  const auto algorithm = kind == Pooling::largest   ? dnnl::algorithm::pooling_max
                         : kind == Pooling::average ? dnnl::algorithm::pooling_avg_exclude_padding
                                                    : dnnl::algorithm::pooling_avg_include_padding;
  const dnnl::pooling_forward::primitive_desc description(
      cpu(), dnnl::prop_kind::forward_inference, algorithm, image_desc(in.shape, in.type), image_desc(shape, in.type),
      window.strides, window.kernel, {0, 0}, first(window.pads), last(window.pads), own_scratch());
  return run_simple<dnnl::pooling_forward>(engine, description, in, shape);
}

namespace {

/// Where a result reads along one axis: between two neighbours.
struct Between {
  std::int64_t first = 0, second = 0;
  float t = 0.0F;
};

/// Pixel centres at half integers, borders repeated.
std::vector<Between> places_between(std::int64_t size, std::int64_t wanted) {
  std::vector<Between> places(static_cast<std::size_t>(wanted));
  const float ratio = static_cast<float>(size) / static_cast<float>(wanted);
  for (std::int64_t i = 0; i < wanted; ++i) {
    const float place = (static_cast<float>(i) + 0.5F) * ratio - 0.5F;
    const float inside = std::clamp(place, 0.0F, static_cast<float>(size - 1));
    const auto first = static_cast<std::int64_t>(inside);
    places[i] = {first, std::min(first + 1, size - 1), inside - static_cast<float>(first)};
  }
  return places;
}

/// One image of rows whose pixels have `channels` values side by side, enlarged; a row of it is needed for some
/// results in turn and is stretched once.
class Enlarger {
 public:
  Enlarger(const Array& in, std::int64_t channels, std::int64_t row_step, const std::vector<Between>& across)
      : in_(in), channels_(channels), row_step_(row_step), across_(across) {}

  void write(std::int64_t image_offset, const Between& down, float* out) {
    const float *above = row(image_offset, down.first), *below = row(image_offset, down.second);
    blend(above, below, down.t, across_.size() * channels_, out);
  }

 private:
  struct Stretched {
    std::int64_t offset = -1;
    std::vector<float> values;
  };

  const float* row(std::int64_t image_offset, std::int64_t index) {
    const std::int64_t offset = image_offset + index * row_step_;
    for (const Stretched& known : known_) {
      if (known.offset == offset) return known.values.data();
    }
    Stretched& oldest = known_[next_];
    next_ = 1 - next_;
    oldest.offset = offset;
    stretch(offset, oldest.values);
    return oldest.values.data();
  }

  void stretch(std::int64_t offset, std::vector<float>& values) {
    const std::int64_t width = in_.shape[3] * channels_;
    raw_.resize(static_cast<std::size_t>(width));
    values.resize(across_.size() * channels_);
    if (in_.type == Type::bf16) {
      bf16_to_floats(in_.data<std::uint16_t>() + offset, raw_.size(), raw_.data());
    } else {
      std::copy_n(in_.data<float>() + offset, width, raw_.data());
    }
    for (std::size_t i = 0; i < across_.size(); ++i) {
      const auto& [first, second, t] = across_[i];
      const float *left = &raw_[first * channels_], *right = &raw_[second * channels_];
      float* to = &values[i * channels_];
      if (channels_ >= 16) {
        blend(left, right, t, channels_, to);
      } else {
        for (std::int64_t c = 0; c < channels_; ++c) to[c] = (1.0F - t) * left[c] + t * right[c];
      }
    }
  }

  const Array& in_;
  std::int64_t channels_, row_step_;
  const std::vector<Between>& across_;
  std::array<Stretched, 2> known_;
  std::size_t next_ = 0;
  std::vector<float> raw_;
};

}  // namespace

Array resize_images(Engine& engine, const Array& images, std::int64_t rows, std::int64_t columns) {
  const bool side_by_side = images.strides[1] == 1 && images.shape[1] > 1;
  const Type type = images.type == Type::bf16 ? Type::bf16 : Type::f32;
  const Array in = side_by_side ? as_images(engine, images) : as_row_major(engine.pool(), images, type);
  const Dims shape{in.shape[0], in.shape[1], rows, columns};
  const Array out = make_array(engine.pool(), type, shape, side_by_side ? channels_last(shape) : row_major(shape));
  const std::int64_t channels = side_by_side ? shape[1] : 1, planes = side_by_side ? shape[0] : shape[0] * shape[1];
  const std::vector<Between> down = places_between(in.shape[2], rows), across = places_between(in.shape[3], columns);
  const std::int64_t plane = in.shape[2] * in.shape[3] * channels, width = columns * channels;
  constexpr std::int64_t kRows = 64;  // of the result, for one thread
  const std::int64_t groups = (rows + kRows - 1) / kRows;
  engine.parallel(planes * groups, [&](std::int64_t task) {
    Enlarger enlarger(in, channels, in.shape[3] * channels, across);
    std::vector<float> room(type == Type::bf16 ? width : 0);
    const std::int64_t index = task / groups, first = task % groups * kRows;
    for (std::int64_t r = first; r < std::min(rows, first + kRows); ++r) {
      const std::int64_t at = (index * rows + r) * width;
      if (type == Type::f32) {
        enlarger.write(index * plane, down[r], out.data<float>() + at);
      } else {
        enlarger.write(index * plane, down[r], room.data());
        floats_to_bf16(room.data(), room.size(), out.data<std::uint16_t>() + at);
      }
    }
  });
  return out;
}

namespace {

constexpr std::int64_t kPaddedChannels = 16;

/// Rows of an image with its border of zeros, as a few-input convolution reads them.
class PaddedRows {
 public:
  PaddedRows(const Array& in, const Window& window, std::int64_t image)
      : in_(in), window_(window), start_(in.data<float>() + image * in.strides[0]) {
    const std::int64_t width = (in.shape[3] + window.pads[1] + window.pads[3]) * in.shape[1];
    rows_.assign(static_cast<std::size_t>(window.kernel[0]), std::vector<float>(width, 0.0F));
  }

  /// The kernel's rows for one row of the result.
  void load(std::int64_t result_row) {
    const std::int64_t width = in_.shape[3] * in_.shape[1], left = window_.pads[1] * in_.shape[1];
    for (std::int64_t r = 0; r < window_.kernel[0]; ++r) {
      const std::int64_t from = result_row * window_.strides[0] - window_.pads[0] + r;
      const bool inside = from >= 0 && from < in_.shape[2];
      float* to = rows_[r].data() + left;
      inside ? (void)std::copy_n(start_ + from * width, width, to) : (void)std::fill_n(to, width, 0.0F);
    }
  }
  std::vector<const float*> pointers() const {
    std::vector<const float*> starts;
    starts.reserve(rows_.size());
    for (const auto& row : rows_) starts.push_back(row.data());
    return starts;
  }

 private:
  const Array& in_;
  const Window& window_;
  const float* start_;
  std::vector<std::vector<float>> rows_;
};

}  // namespace

bool SmallConvolution::suits(const Array& weights, const Window& window, std::int64_t groups) {
  constexpr std::int64_t kMostInputs = 16, kMostChannels = 64;
  return groups == 1 && weights.shape[1] * weights.shape[2] * weights.shape[3] <= kMostInputs &&
         weights.shape[0] <= kMostChannels && window.dilations == Dims{1, 1};
}

SmallConvolution::SmallConvolution(Engine& engine, const Array& weights, const Array& bias, const Window& window,
                                   bool relu)
    : window_(window), relu_(relu), channels_(weights.shape[0]) {
  const std::int64_t padded = (channels_ + kPaddedChannels - 1) / kPaddedChannels * kPaddedChannels;
  // [rows, columns, inputs, outputs]
  const Dims shape{weights.shape[2], weights.shape[3], weights.shape[1], padded};
  weights_.assign(static_cast<std::size_t>(count_of(shape)), 0.0F);
  bias_.assign(static_cast<std::size_t>(padded), 0.0F);
  const Array dense = as_row_major(engine.pool(), weights, Type::f32);
  const Dims& s = dense.strides;
  for (std::int64_t i = 0; i < dense.count(); ++i) {
    const std::int64_t o = i / s[0], c = i / s[1] % weights.shape[1], y = i / s[2] % shape[0], x = i % shape[1];
    weights_[((y * shape[1] + x) * shape[2] + c) * padded + o] = dense.data<float>()[i];
  }
  if (bias) {
    const Array plain = as_row_major(engine.pool(), bias, Type::f32);
    std::copy_n(plain.data<float>(), channels_, bias_.begin());
  }
}

Array SmallConvolution::run(Engine& engine, const Array& images, Type result) const {
  const Array in = as_channels_last(engine.pool(), images, Type::f32);
  const Dims shape = result_shape(window_, in.shape, channels_);
  const Array out = make_array(engine.pool(), result, shape, channels_last(shape));
  constexpr std::int64_t kRows = 64;  // of the result, for one thread
  const std::int64_t groups = (shape[2] + kRows - 1) / kRows, width = shape[3] * channels_;
  engine.parallel(shape[0] * groups, [&](std::int64_t task) {
    const std::int64_t image = task / groups, first = task % groups * kRows;
    PaddedRows rows(in, window_, image);
    const std::vector<const float*> starts = rows.pointers();
    const std::int64_t inputs = in.shape[1];
    const FewInputs few{starts.data(),
                        starts.size(),
                        static_cast<std::size_t>(window_.kernel[1] * inputs),
                        static_cast<std::size_t>(window_.strides[1] * inputs),
                        static_cast<std::size_t>(channels_),
                        weights_.data(),
                        bias_.data(),
                        relu_};
    std::vector<float> room(static_cast<std::size_t>(width));
    for (std::int64_t r = first; r < std::min(shape[2], first + kRows); ++r) {
      rows.load(r);
      const std::int64_t at = (image * shape[2] + r) * width;
      convolve(few, static_cast<std::size_t>(shape[3]), result == Type::f32 ? out.data<float>() + at : room.data());
      if (result == Type::bf16) floats_to_bf16(room.data(), room.size(), out.data<std::uint16_t>() + at);
    }
  });
  return out;
}

}  // namespace demslam::nn
