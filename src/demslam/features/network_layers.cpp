#include <algorithm>
#include <cmath>

#include "demslam/features/network_images.h"
#include "demslam/features/network_kernels.h"
#include "demslam/features/network_operators.h"

namespace demslam::nn {
namespace {

Window window_of(const Site& site) {
  Window window;
  window.kernel = site.integers("kernel_shape", {});
  window.strides = site.integers("strides", {1, 1});
  window.dilations = site.integers("dilations", {1, 1});
  window.pads = site.integers("pads", {0, 0, 0, 0});
  site.require(site.text("auto_pad", "NOTSET") == "NOTSET", "automatic padding");
  site.require(window.strides.size() == 2 && window.dilations.size() == 2 && window.pads.size() == 4,
               "other than images");
  const auto in_range = [](std::int64_t low) { return [low](std::int64_t v) { return v >= low && v <= 4096; }; };
  site.require(std::ranges::all_of(window.strides, in_range(1)) && std::ranges::all_of(window.dilations, in_range(1)) &&
                   std::ranges::all_of(window.pads, in_range(0)),
               "its window");
  return window;
}

/// The type in which a convolution leaves its result: halved only where nothing but convolutions reads it.
Type image_type(const Site& site) {
  return site.integer("demslam.for_convolutions", 0) != 0 ? site.engine.factor_type() : Type::f32;
}

template <class Layer>
Step convolution_step(const Site& site, const std::shared_ptr<Layer>& layer, std::int64_t channels) {
  return [&engine = site.engine, layer, channels, type = image_type(site)](const Arrays& in) -> Arrays {
    expect(in.at(0).rank() == 4 && in[0].shape[1] == channels, "a convolution of other channels");
    return {layer->run(engine, in[0], type)};
  };
}

Step convolution(const Site& site) {
  Window window = window_of(site);
  const Array weights = site.constant(1), bias = site.constant(2);
  const std::int64_t groups = site.integer("group", 1);
  site.require(weights.rank() == 4, "other than images");
  const Dims size{weights.shape[2], weights.shape[3]};
  site.require(window.kernel.empty() || window.kernel == size, "a kernel of another size than its weights");
  window.kernel = size;
  site.require(groups >= 1 && weights.shape[0] % groups == 0 && weights.count() > 0, "its groups");
  site.require(!bias || bias.count() == weights.shape[0], "its bias");
  const bool relu = site.integer("demslam.relu", 0) != 0;
  if (SmallConvolution::suits(weights, window, groups)) {
    return convolution_step(site, std::make_shared<SmallConvolution>(site.engine, weights, bias, window, relu),
                            weights.shape[1]);
  }
  return convolution_step(site, std::make_shared<Convolution>(site.engine, weights, bias, window, groups, relu),
                          weights.shape[1] * groups);
}

Step pooling(const Site& site, Pooling kind) {
  const Window window = window_of(site);
  site.require(window.kernel.size() == 2 && site.integer("ceil_mode", 0) == 0, "its window");
  site.require(window.dilations == Dims{1, 1} && site.outputs() == 1, "dilations or indices");
  return [&engine = site.engine, window, kind](const Arrays& in) -> Arrays {
    expect(in.at(0).rank() == 4, "pooling of other than images");
    return {pool_images(engine, kind, window, in[0])};
  };
}

Step average_pool(const Site& site) {
  const bool padding = site.integer("count_include_pad", 0) != 0;
  return pooling(site, padding ? Pooling::average_with_padding : Pooling::average);
}

Step max_pool(const Site& site) {
  site.require(site.integer("storage_order", 0) == 0, "its storage order");
  return pooling(site, Pooling::largest);
}

std::vector<float> floats_of(Engine& engine, const Array& a) {
  const Array dense = as_row_major(engine.pool(), a, Type::f32);
  return {dense.data<float>(), dense.data<float>() + dense.count()};
}

void check_resize(const Site& site) {
  const std::string mode = site.text("coordinate_transformation_mode", "half_pixel");
  site.require(site.text("mode", "nearest") == "linear", "another mode than 'linear'");
  site.require(mode == "half_pixel" || mode == "pytorch_half_pixel", "coordinates '" + mode + "'");
  site.require(site.integer("antialias", 0) == 0 && site.integer("exclude_outside", 0) == 0 && !site.has("axes"),
               "its options");
  site.require(site.text("keep_aspect_ratio_policy", "stretch") == "stretch", "its options");
  for (const char* unused : {"cubic_coeff_a", "nearest_mode", "extrapolation_value"}) site.ignore(unused);
}

Step resize(const Site& site) {
  check_resize(site);
  if (site.has_input(3)) {
    return [&engine = site.engine](const Arrays& in) -> Arrays {
      const Dims sizes = integers_of(in.at(3));
      expect(in[0].rank() == 4 && sizes.size() == 4 && sizes[0] == in[0].shape[0] && sizes[1] == in[0].shape[1] &&
                 sizes[2] > 0 && sizes[3] > 0,
             "a resize of other than rows and columns");
      return {resize_images(engine, in[0], sizes[2], sizes[3])};
    };
  }
  const std::vector<float> scales = floats_of(site.engine, site.constant(2));
  const auto whole = [](float scale) { return scale >= 1.0F && scale <= 64.0F && scale == std::floor(scale); };
  site.require(scales.size() == 4 && scales[0] == 1.0F && scales[1] == 1.0F && std::ranges::all_of(scales, whole),
               "scales that are not whole");
  const auto down = static_cast<std::int64_t>(scales[2]), across = static_cast<std::int64_t>(scales[3]);
  return [&engine = site.engine, down, across](const Arrays& in) -> Arrays {
    expect(in.at(0).rank() == 4, "a resize of other than images");
    return {resize_images(engine, in[0], in[0].shape[2] * down, in[0].shape[3] * across)};
  };
}

Step linear_layer(const Site& site, const Array& weights, const Array& bias) {
  site.require(weights.rank() == 2 && weights.count() > 0, "weights of other than two axes");
  site.require(!bias || (bias.rank() == 1 && bias.count() == weights.shape[1]), "its bias");
  const auto layer = std::make_shared<Linear>(site.engine, weights, bias);
  return [&engine = site.engine, layer, inputs = weights.shape[0]](const Arrays& in) -> Arrays {
    expect(in.at(0).rank() >= 1 && in[0].shape.back() == inputs, "a linear layer of another width");
    return {layer->run(engine, in[0])};
  };
}

/// x W + b, made of MatMul and Add.
Step linear(const Site& site) { return linear_layer(site, site.constant(1), site.constant(2)); }

Step gemm(const Site& site) {
  site.require(site.number("alpha", 1.0F) == 1.0F && site.number("beta", 1.0F) == 1.0F, "factors");
  site.require(site.integer("transA", 0) == 0, "transA");
  const Array weights = site.constant(1);
  const bool transposed = site.integer("transB", 0) != 0;
  return linear_layer(site, transposed ? permuted(weights, {1, 0}) : weights, site.constant(2));
}

Step mat_mul(const Site& site) {
  return [&engine = site.engine, &products = site.products](const Arrays& in) -> Arrays {
    expect(in.at(0).rank() >= 2 && in.at(1).rank() >= 2, "a matrix product of other than matrices");
    return {multiply(engine, products, in[0], in[1])};
  };
}

Array softmax_of(Engine& engine, const Array& scores) {
  const std::int64_t size = scores.shape.back();
  const Array out = make_array(engine.pool(), Type::f32, scores.shape);
  for (std::int64_t i = 0; i < scores.count(); i += size) {
    softmax(scores.data<float>() + i, static_cast<std::size_t>(size), out.data<float>() + i);
  }
  return out;
}

bool equal_batches(const Array& a, const Array& b) {
  return a.rank() == b.rank() && std::equal(a.shape.begin(), a.shape.end() - 2, b.shape.begin());
}

/// MatMul, Softmax along the last axis, MatMul.
Step attention_layer(const Site& site) {
  return [&engine = site.engine, &products = site.products,
          axis = site.integer("axis", -1)](const Arrays& in) -> Arrays {
    const Array &queries = in.at(0), &keys = in.at(1), &values = in.at(2);
    expect(std::ranges::all_of(in, [](const Array& a) { return a.rank() >= 2; }), "attention of other than matrices");
    const std::size_t rank = std::max(queries.rank(), keys.rank());
    expect(axis_of(axis, rank) + 1 == rank, "attention along another axis than the last");
    expect(queries.shape.back() == keys.shape.end()[-2] && keys.shape.back() == values.shape.end()[-2],
           "attention of unequal sizes");
    if (equal_batches(queries, keys) && equal_batches(queries, values)) {
      return {attention(engine, products, queries, keys, values)};
    }
    return {multiply(engine, products, softmax_of(engine, multiply(engine, products, queries, keys)), values)};
  };
}

/// Images read at places of their own, bilinear, zero outside.
struct Sampling {
  bool align_corners;

  /// -1 ... 1 -> pixels.
  float place(float along, std::int64_t size) const {
    const auto pixels = static_cast<float>(size);
    return align_corners ? (along + 1.0F) * 0.5F * (pixels - 1.0F) : ((along + 1.0F) * pixels - 1.0F) * 0.5F;
  }

  void read(const Array& images, std::int64_t image, float x, float y, float* out) const {
    const float u = place(x, images.shape[3]), v = place(y, images.shape[2]);
    const auto channels = static_cast<std::size_t>(images.shape[1]);
    std::fill_n(out, channels, 0.0F);
    if (!(std::abs(u) < 1e6F && std::abs(v) < 1e6F)) return;
    const auto left = static_cast<std::int64_t>(std::floor(u)), top = static_cast<std::int64_t>(std::floor(v));
    const float fu = u - static_cast<float>(left), fv = v - static_cast<float>(top);
    for (const int j : {0, 1}) {
      for (const int i : {0, 1}) {
        if (left + i < 0 || top + j < 0 || left + i >= images.shape[3] || top + j >= images.shape[2]) continue;
        const float weight = (i ? fu : 1.0F - fu) * (j ? fv : 1.0F - fv);
        const float* pixel = images.data<float>() + image * images.strides[0] + (top + j) * images.strides[2] +
                             (left + i) * images.strides[3];
        for (std::size_t c = 0; c < channels; ++c) out[c] += weight * pixel[c];
      }
    }
  }
};

Step grid_sample(const Site& site) {
  const std::string mode = site.text("mode", "bilinear");
  site.require(mode == "bilinear" || mode == "linear", "mode '" + mode + "'");
  site.require(site.text("padding_mode", "zeros") == "zeros", "another padding than zeros");
  const Sampling sampling{site.integer("align_corners", 0) != 0};
  return [&engine = site.engine, sampling](const Arrays& in) -> Arrays {
    expect(in.at(0).rank() == 4 && in.at(1).rank() == 4 && in[1].shape[3] == 2 && in[0].shape[0] == in[1].shape[0],
           "GridSample of other than images");
    const Array images = as_channels_last(engine.pool(), in[0], Type::f32);
    const Array places = as_row_major(engine.pool(), in[1], Type::f32);
    const Dims shape{images.shape[0], images.shape[1], places.shape[1], places.shape[2]};
    const Array out = make_array(engine.pool(), Type::f32, shape, channels_last(shape));
    const std::int64_t each = shape[2] * shape[3];
    for (std::int64_t i = 0; i < shape[0] * each; ++i) {
      const float* at = places.data<float>() + 2 * i;
      sampling.read(images, i / each, at[0], at[1], out.data<float>() + i * shape[1]);
    }
    return {out};
  };
}

}  // namespace

void add_layer_operators(Makers& makers) {
  makers.insert({{"Conv", convolution},
                 {"AveragePool", average_pool},
                 {"MaxPool", max_pool},
                 {"Resize", resize},
                 {"Gemm", gemm},
                 {"MatMul", mat_mul},
                 {"GridSample", grid_sample},
                 {"demslam.Linear", linear},
                 {"demslam.Attention", attention_layer}});
}

}  // namespace demslam::nn
