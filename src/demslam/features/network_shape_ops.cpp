#include <algorithm>
#include <cmath>
#include <numeric>

#include "demslam/features/network_operators.h"

namespace demslam::nn {
namespace {

/// The elements first, first + step, ... of an axis.
Array strided_part(const Array& a, std::size_t axis, std::int64_t first, std::int64_t step, std::int64_t count) {
  Array view = a;
  view.start += first * a.strides[axis] * static_cast<std::int64_t>(size_of(a.type));
  view.shape[axis] = count;
  view.strides[axis] *= step;
  return view;
}

Step identity(const Site&) {
  return [](const Arrays& in) -> Arrays { return {in.at(0)}; };
}

Step constant(const Site& site) {
  if (const OnnxConstant* value = site.tensor("value")) {
    site.require(value->kind != OnnxConstant::Kind::other, "a value of its type");
    return [array = to_array(site.engine.pool(), *value)](const Arrays&) -> Arrays { return {array}; };
  }
  OnnxConstant value{.kind = OnnxConstant::Kind::floats};
  if (site.has("value_float")) {
    value.floats = {site.number("value_float", 0.0F)};
  } else {
    site.require(site.has("value_int") || site.has("value_ints"), "its attributes");
    value.kind = OnnxConstant::Kind::integers;
    value.integers = site.has("value_int") ? Dims{site.integer("value_int", 0)} : site.integers("value_ints", {});
    if (site.has("value_ints")) value.shape = {static_cast<std::int64_t>(value.integers.size())};
  }
  return [array = to_array(site.engine.pool(), value)](const Arrays&) -> Arrays { return {array}; };
}

Step constant_of_shape(const Site& site) {
  OnnxConstant value{.kind = OnnxConstant::Kind::floats, .shape = {1}, .floats = {0.0F}};
  if (const OnnxConstant* given = site.tensor("value")) value = *given;
  site.require(value.kind != OnnxConstant::Kind::other, "a value of its type");
  const Array one = to_array(site.engine.pool(), value);
  expect(one.count() == 1, "a fill of several values");
  return [one](const Arrays& in) -> Arrays {
    Array view = one;
    view.shape = integers_of(in.at(0));
    expect(std::ranges::all_of(view.shape, [](std::int64_t size) { return size >= 0; }), "a negative size");
    view.strides.assign(view.shape.size(), 0);
    return {view};
  };
}

Step shape(const Site& site) {
  const std::int64_t start = site.integer("start", 0), end = site.integer("end", INT64_MAX);
  return [&engine = site.engine, start, end](const Arrays& in) -> Arrays {
    const auto rank = static_cast<std::int64_t>(in.at(0).rank());
    const auto bounded = [&](std::int64_t i) { return std::clamp<std::int64_t>(i < 0 ? i + rank : i, 0, rank); };
    const Dims& all = in[0].shape;
    const std::int64_t first = bounded(start), last = std::max(bounded(end), first);
    return {integer_array(engine.pool(), {all.begin() + first, all.begin() + last})};
  };
}

/// Zero: as it is; -1: what is left.
Dims wanted_shape(const Dims& have, Dims wanted, bool zero_is_zero) {
  std::int64_t known = 1;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (wanted[i] == 0 && !zero_is_zero) {
      expect(i < have.size(), "a reshape that keeps an axis that is not there");
      wanted[i] = have[i];
    }
    if (wanted[i] != -1) known *= wanted[i];
  }
  const std::int64_t all = count_of(have);
  for (std::int64_t& size : wanted) {
    if (size == -1) size = known == 0 ? 0 : all / known;
    expect(size >= 0, "a reshape to a negative size");
  }
  return wanted;
}

Step reshape(const Site& site) {
  const bool zero_is_zero = site.integer("allowzero", 0) != 0;
  return [&engine = site.engine, zero_is_zero](const Arrays& in) -> Arrays {
    return {reshaped(engine.pool(), in.at(0), wanted_shape(in[0].shape, integers_of(in.at(1)), zero_is_zero))};
  };
}

Step flatten(const Site& site) {
  const std::int64_t axis = site.integer("axis", 1);
  return [&engine = site.engine, axis](const Arrays& in) -> Arrays {
    const Dims& have = in.at(0).shape;
    const std::size_t at = axis == static_cast<std::int64_t>(have.size()) ? have.size() : axis_of(axis, have.size());
    const Dims outer(have.begin(), have.begin() + static_cast<std::ptrdiff_t>(at));
    const std::int64_t rows = count_of(outer), all = in[0].count();
    return {reshaped(engine.pool(), in[0], {rows, rows == 0 ? 0 : all / rows})};
  };
}

/// Axes of an operator that has them as its second input or, in older operator sets, as an attribute.
struct Axes {
  Dims fixed;
  bool is_input;

  explicit Axes(const Site& site) : fixed(site.integers("axes", {})), is_input(site.has_input(1)) {}
  Dims of(const Arrays& in) const { return is_input ? integers_of(in.at(1)) : fixed; }
};

Step squeeze(const Site& site) {
  return [axes = Axes(site)](const Arrays& in) -> Arrays {
    const Array& a = in.at(0);
    std::vector<bool> drop(a.rank(), false);
    for (const std::int64_t axis : axes.of(in)) drop[axis_of(axis, a.rank())] = true;
    const bool every = axes.of(in).empty();
    Array view = a;
    view.shape.clear();
    view.strides.clear();
    for (std::size_t i = 0; i < a.rank(); ++i) {
      const bool dropped = every ? a.shape[i] == 1 : drop[i];
      expect(!dropped || a.shape[i] == 1, "a squeeze of an axis that is longer than one");
      if (dropped) continue;
      view.shape.push_back(a.shape[i]);
      view.strides.push_back(a.strides[i]);
    }
    return {view};
  };
}

Step unsqueeze(const Site& site) {
  return [axes = Axes(site)](const Arrays& in) -> Arrays {
    Array view = in.at(0);
    const Dims wanted = axes.of(in);
    const std::size_t rank = view.rank() + wanted.size();
    std::vector<std::size_t> places;
    for (const std::int64_t axis : wanted) places.push_back(axis_of(axis, rank));
    std::ranges::sort(places);
    for (const std::size_t place : places) {
      expect(place <= view.rank(), "an axis that is added twice");
      view.shape.insert(view.shape.begin() + static_cast<std::ptrdiff_t>(place), 1);
      view.strides.insert(view.strides.begin() + static_cast<std::ptrdiff_t>(place), 1);
    }
    return {view};
  };
}

Step transpose(const Site& site) {
  return [order = site.integers("perm", {})](const Arrays& in) -> Arrays {
    Dims wanted = order;
    if (wanted.empty()) {
      wanted.resize(in.at(0).rank());
      std::iota(wanted.rbegin(), wanted.rend(), 0);
    }
    return {permuted(in.at(0), wanted)};
  };
}

Array sliced(const Array& a, std::size_t axis, std::int64_t start, std::int64_t end, std::int64_t step) {
  expect(step != 0, "a slice of step zero");
  const std::int64_t size = a.shape[axis], lowest = step > 0 ? 0 : -1, highest = step > 0 ? size : size - 1;
  const auto bounded = [&](std::int64_t i) { return std::clamp(i < 0 ? i + size : i, lowest, highest); };
  const std::int64_t first = bounded(std::max(start, -size - 1)), last = bounded(std::max(end, -size - 1));
  const std::int64_t span = step > 0 ? last - first : first - last, stride = std::abs(std::max(step, -size - 1));
  return strided_part(a, axis, std::max<std::int64_t>(first, 0), step, span > 0 ? (span + stride - 1) / stride : 0);
}

Step slice(const Site& site) {
  site.require(site.has_input(2), "its form before operator set 10");
  return [](const Arrays& in) -> Arrays {
    Array view = in.at(0);
    const Dims starts = integers_of(in.at(1)), ends = integers_of(in.at(2));
    Dims axes(starts.size()), steps(starts.size(), 1);
    std::iota(axes.begin(), axes.end(), 0);
    if (in.size() > 3 && in[3]) axes = integers_of(in[3]);
    if (in.size() > 4 && in[4]) steps = integers_of(in[4]);
    expect(ends.size() == starts.size() && axes.size() == starts.size() && steps.size() == starts.size(),
           "a slice of unequal lists");
    for (std::size_t i = 0; i < starts.size(); ++i) {
      view = sliced(view, axis_of(axes[i], view.rank()), starts[i], ends[i], steps[i]);
    }
    return {view};
  };
}

Step split(const Site& site) {
  const std::int64_t axis = site.integer("axis", 0);
  const auto parts = static_cast<std::int64_t>(site.outputs());
  site.ignore("num_outputs");
  const Dims fixed = site.constant_integers(1, "split", {});
  return [axis, parts, fixed](const Arrays& in) -> Arrays {
    const std::size_t at = axis_of(axis, in.at(0).rank());
    const std::int64_t size = in[0].shape[at], each = (size + parts - 1) / parts;
    Arrays result;
    for (std::int64_t i = 0, first = 0; i < parts; ++i) {
      const std::int64_t count = fixed.empty() ? std::min(each, size - first) : fixed.at(static_cast<std::size_t>(i));
      expect(count >= 0 && first + count <= size, "a split into more than there is");
      result.push_back(strided_part(in[0], at, first, 1, count));
      first += count;
    }
    return result;
  };
}

/// The layout of the first part where it is an image with its channels side by side, else row-major.
Dims joined_strides(const Array& like, const Dims& shape) {
  const bool image = shape.size() == 4 && like.shape[1] > 1 && like.strides[1] == 1;
  return image ? channels_last(shape) : row_major(shape);
}

Type common_type(const Arrays& parts) {
  for (const Array& part : parts) {
    if (part.type != parts[0].type) return Type::f32;
  }
  return parts[0].type;
}

Step concat(const Site& site) {
  const std::int64_t axis = site.integer("axis", 0);
  return [&engine = site.engine, axis](const Arrays& in) -> Arrays {
    const std::size_t at = axis_of(axis, in.at(0).rank());
    Dims whole = in[0].shape;
    whole[at] = 0;
    for (const Array& part : in) {
      expect(part.rank() == whole.size(), "a concatenation of unequal ranks");
      for (std::size_t i = 0; i < whole.size(); ++i) {
        expect(i == at || part.shape[i] == whole[i], "a concatenation of unequal shapes");
      }
      whole[at] += part.shape[at];
    }
    const Array out = make_array(engine.pool(), common_type(in), whole, joined_strides(in.back(), whole));
    std::int64_t first = 0;
    for (const Array& part : in) {
      copy(part, strided_part(out, at, first, 1, part.shape[at]));
      first += part.shape[at];
    }
    return {out};
  };
}

Step expand(const Site& site) {
  return [&engine = site.engine](const Arrays& in) -> Arrays {
    const Array& a = in.at(0);
    Dims wanted = integers_of(in.at(1));
    if (wanted.size() < a.rank()) wanted.insert(wanted.begin(), a.rank() - wanted.size(), 1);
    Array view = a;
    view.shape.insert(view.shape.begin(), wanted.size() - a.rank(), 1);
    view.strides.insert(view.strides.begin(), wanted.size() - a.rank(), 0);
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      if (view.shape[i] == wanted[i] || wanted[i] == 1) continue;
      expect(view.shape[i] == 1 && wanted[i] >= 0, "an expansion of an axis that is longer than one");
      view.shape[i] = wanted[i];
      view.strides[i] = 0;
    }
    return {as_row_major(engine.pool(), view, view.type)};
  };
}

Step range(const Site& site) {
  return [&engine = site.engine](const Arrays& in) -> Arrays {
    for (const Array& a : in) expect(a.type == Type::i64 && a.count() == 1, "a range of other than integers");
    const std::int64_t first = *in.at(0).data<std::int64_t>(), end = *in.at(1).data<std::int64_t>(),
                       step = *in.at(2).data<std::int64_t>();
    expect(step != 0, "a range of step zero");
    Dims values;
    for (std::int64_t i = first; step > 0 ? i < end : i > end; i += step) values.push_back(i);
    return {integer_array(engine.pool(), values)};
  };
}

/// [N,C,H,W] -> [N, C * b * b, H / b, W / b], channels side by side. ONNX has the place within the block before the
/// channel; PyTorch's pixel_unshuffle, which exporters write as reshapes, the channel before it.
Array blocks_to_channels(Engine& engine, const Array& a, std::int64_t block, bool channel_first) {
  expect(a.rank() == 4 && a.shape[2] % block == 0 && a.shape[3] % block == 0,
         "an image that does not divide into blocks");
  const Dims& s = a.shape;
  const std::int64_t rows = s[2] / block, columns = s[3] / block;
  Array view = a;
  view.shape = {s[0], s[1], rows, block, columns, block};
  view.strides = {a.strides[0], a.strides[1], a.strides[2] * block, a.strides[2], a.strides[3] * block, a.strides[3]};
  const Array from = permuted(view, channel_first ? Dims{0, 2, 4, 1, 3, 5} : Dims{0, 2, 4, 3, 5, 1});
  const Array out = as_row_major(engine.pool(), from, a.type);  // pixel by pixel, its channels side by side
  Array result = out;
  result.shape = {s[0], rows, columns, s[1] * block * block};
  result.strides = row_major(result.shape);
  return with_axis_moved(result, 3, 1);
}

Step space_to_depth(const Site& site) {
  const std::int64_t block = site.integer("blocksize", 0);
  const bool channel_first = site.integer("channel_first", 0) != 0;
  site.require(block > 0, "its block size");
  return [&engine = site.engine, block, channel_first](const Arrays& in) -> Arrays {
    return {blocks_to_channels(engine, in.at(0), block, channel_first)};
  };
}

}  // namespace

void add_shape_operators(Makers& makers) {
  makers.insert({{"Identity", identity},
                 {"Constant", constant},
                 {"ConstantOfShape", constant_of_shape},
                 {"Shape", shape},
                 {"Reshape", reshape},
                 {"Flatten", flatten},
                 {"Squeeze", squeeze},
                 {"Unsqueeze", unsqueeze},
                 {"Transpose", transpose},
                 {"Slice", slice},
                 {"Split", split},
                 {"Concat", concat},
                 {"Expand", expand},
                 {"Range", range},
                 {"SpaceToDepth", space_to_depth},
                 {"demslam.SpaceToDepth", space_to_depth}});
}

}  // namespace demslam::nn
