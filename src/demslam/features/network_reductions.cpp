#include <algorithm>
#include <cmath>

#include "demslam/features/network_kernels.h"
#include "demslam/features/network_operators.h"

namespace demslam::nn {
namespace {

constexpr std::int64_t kValuesPerTask = 1 << 15;

/// work(row) for each of the rows of `size` values, shared out in groups.
template <class Work>
void for_each_row(Engine& engine, std::int64_t rows, std::int64_t size, const Work& work) {
  const std::int64_t group = kValuesPerTask / std::max<std::int64_t>(size, 1) + 1;
  engine.parallel((rows + group - 1) / group, [&](std::int64_t i) {
    for (std::int64_t r = i * group; r < std::min(rows, (i + 1) * group); ++r) work(r);
  });
}

enum class Reduction { mean, sum, maximum, minimum, l2 };

float reduced(Reduction kind, const float* row, std::int64_t size) {
  const auto n = static_cast<std::size_t>(size);
  switch (kind) {
    case Reduction::mean:
      return sum(row, n) / static_cast<float>(size);
    case Reduction::sum:
      return sum(row, n);
    case Reduction::maximum:
      return largest(row, n);
    case Reduction::minimum:
      return *std::min_element(row, row + size);
    case Reduction::l2:
      return std::sqrt(sum_of_squares(row, 0.0F, n));
  }
  return 0.0F;
}

/// The array with the axes to be reduced behind all others, and the result's shape with ones in their place.
struct Reduced {
  Array moved;
  Dims kept;
  std::int64_t size = 1;
};

Reduced arrange(const Array& a, const Dims& axes) {
  std::vector<bool> goes(a.rank(), axes.empty());
  for (const std::int64_t axis : axes) goes[axis_of(axis, a.rank())] = true;
  Dims order;
  Reduced result{.kept = a.shape};
  for (const bool behind : {false, true}) {
    for (std::size_t i = 0; i < a.rank(); ++i) {
      if (goes[i] == behind) order.push_back(static_cast<std::int64_t>(i));
      if (goes[i] && behind) result.size *= a.shape[i], result.kept[i] = 1;
    }
  }
  result.moved = permuted(a, order);
  return result;
}

Dims without_ones(const Dims& kept, const Dims& axes) {
  Dims shape;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    const bool gone =
        axes.empty() || std::ranges::any_of(axes, [&](std::int64_t axis) { return axis_of(axis, kept.size()) == i; });
    if (!gone) shape.push_back(kept[i]);
  }
  return shape;
}

/// A few slices along one axis that is not the last, added or compared as wholes.
Array reduced_by_slices(Engine& engine, Reduction kind, const Array& a, std::size_t axis) {
  Array slice = a;
  slice.shape[axis] = 1;
  const Array out = make_array(engine.pool(), Type::f32, slice.shape);
  copy(slice, out);
  const Binary function = kind == Reduction::maximum   ? Binary::maximum
                          : kind == Reduction::minimum ? Binary::minimum
                                                       : Binary::add;
  const auto count = static_cast<std::size_t>(out.count());
  for (std::int64_t i = 1; i < a.shape[axis]; ++i) {
    slice.start = a.start + i * a.strides[axis] * static_cast<std::int64_t>(size_of(a.type));
    const Array next = as_row_major(engine.pool(), slice, Type::f32);
    apply(function, out.data<float>(), 1, next.data<float>(), 1, count, out.data<float>());
  }
  const float share = 1.0F / static_cast<float>(a.shape[axis]);
  if (kind == Reduction::mean) scale(out.data<float>(), share, count, out.data<float>());
  return out;
}

bool is_few_slices(Reduction kind, const Array& a, const Dims& axes) {
  constexpr std::int64_t kFew = 8;
  if (axes.size() != 1 || kind == Reduction::l2) return false;
  const std::size_t axis = axis_of(axes[0], a.rank());
  return axis + 1 < a.rank() && a.shape[axis] > 0 && a.shape[axis] <= kFew;
}

template <Reduction kind>
Step reduction(const Site& site) {
  const Dims axes = site.constant_integers(1, "axes", {});
  const bool keep = site.integer("keepdims", 1) != 0;
  site.require(site.integer("noop_with_empty_axes", 0) == 0 || !axes.empty(), "no axes");
  return [&engine = site.engine, axes, keep](const Arrays& in) -> Arrays {
    expect(in.at(0).type != Type::i64, "a reduction of integers");
    if (is_few_slices(kind, in[0], axes)) {
      const Array kept = reduced_by_slices(engine, kind, in[0], axis_of(axes[0], in[0].rank()));
      return {keep ? kept : reshaped(engine.pool(), kept, without_ones(kept.shape, axes))};
    }
    const Reduced r = arrange(in[0], axes);
    expect(r.size > 0, "a reduction of nothing");
    const Array rows = as_row_major(engine.pool(), r.moved, Type::f32);
    const Array out = make_array(engine.pool(), Type::f32, keep ? r.kept : without_ones(r.kept, axes));
    for_each_row(engine, out.count(), r.size, [&](std::int64_t i) {
      out.data<float>()[i] = reduced(kind, rows.data<float>() + i * r.size, r.size);
    });
    return {out};
  };
}

void softmax_row(const float* in, std::int64_t size, float* out) { softmax(in, static_cast<std::size_t>(size), out); }

void log_softmax_row(const float* in, std::int64_t size, float* out) {
  const auto n = static_cast<std::size_t>(size);
  const float best = largest(in, n), total = shifted_exp(in, best, n, out), shift = best + std::log(total);
  apply(Binary::subtract, in, 1, &shift, 0, n, out);
}

/// LogSoftmax down the columns of a rows x columns matrix, some columns at a time.
void log_softmax_columns(Engine& engine, const float* in, std::int64_t rows, std::int64_t columns, float* out) {
  constexpr std::int64_t kColumns = 256;
  engine.parallel((columns + kColumns - 1) / kColumns, [&](std::int64_t group) {
    const std::int64_t first = group * kColumns;
    const auto n = static_cast<std::size_t>(std::min(kColumns, columns - first));
    std::vector<float> shift(in + first, in + first + n), total(n, 0.0F);
    for (std::int64_t r = 1; r < rows; ++r) {
      apply(Binary::maximum, shift.data(), 1, in + r * columns + first, 1, n, shift.data());
    }
    for (std::int64_t r = 0; r < rows; ++r) add_shifted_exp(in + r * columns + first, shift.data(), n, total.data());
    for (std::size_t i = 0; i < n; ++i) shift[i] += std::log(total[i]);
    for (std::int64_t r = 0; r < rows; ++r) {
      apply(Binary::subtract, in + r * columns + first, 1, shift.data(), 1, n, out + r * columns + first);
    }
  });
}

Array by_columns(Engine& engine, const Array& a) {
  const Array in = as_row_major(engine.pool(), a, Type::f32);
  const Array out = make_array(engine.pool(), Type::f32, a.shape);
  const std::int64_t columns = a.shape.back(), rows = a.shape.end()[-2], size = rows * columns;
  for (std::int64_t i = 0; i < (size == 0 ? 0 : a.count() / size); ++i) {
    log_softmax_columns(engine, in.data<float>() + i * size, rows, columns, out.data<float>() + i * size);
  }
  return out;
}

/// row(in, size, out) along one axis.
template <class Row>
Array along_axis(Engine& engine, const Array& a, std::size_t axis, const Row& row) {
  const std::size_t last = a.rank() - 1;
  const Array in = as_row_major(engine.pool(), with_axis_moved(a, axis, last), Type::f32);
  const Array out = make_array(engine.pool(), Type::f32, in.shape);
  const std::int64_t size = in.shape.back();
  for_each_row(engine, size == 0 ? 0 : in.count() / size, size,
               [&](std::int64_t r) { row(in.data<float>() + r * size, size, out.data<float>() + r * size); });
  return with_axis_moved(out, last, axis);
}

Step softmax_step(const Site& site) {
  return [&engine = site.engine, axis = site.integer("axis", -1)](const Arrays& in) -> Arrays {
    return {along_axis(engine, in.at(0), axis_of(axis, in.at(0).rank()), softmax_row)};
  };
}

Step log_softmax(const Site& site) {
  return [&engine = site.engine, wanted = site.integer("axis", -1)](const Arrays& in) -> Arrays {
    const std::size_t axis = axis_of(wanted, in.at(0).rank());
    if (axis + 2 == in[0].rank()) return {by_columns(engine, in[0])};
    return {along_axis(engine, in[0], axis, log_softmax_row)};
  };
}

Step layer_normalization(const Site& site) {
  const std::int64_t axis = site.integer("axis", -1);
  const float epsilon = site.number("epsilon", 1e-5F);
  site.require(site.integer("stash_type", 1) == 1 && site.outputs() == 1, "its other outputs");
  const Array weight = as_row_major(site.engine.pool(), site.constant(1), Type::f32);
  const Array bias = site.has_input(2) ? as_row_major(site.engine.pool(), site.constant(2), Type::f32) : Array();
  site.require(weight.rank() == 1 && (!bias || bias.shape == weight.shape), "several axes");
  const Array zeros = make_array(site.engine.pool(), Type::f32, weight.shape);
  std::fill_n(zeros.data<float>(), zeros.count(), 0.0F);
  return [&engine = site.engine, axis, epsilon, weight, bias = bias ? bias : zeros](const Arrays& in) -> Arrays {
    const std::int64_t size = weight.count();
    expect(axis_of(axis, in.at(0).rank()) + 1 == in[0].rank() && in[0].shape.back() == size,
           "LayerNormalization of other axes than the last");
    const auto row = [&](const float* x, std::int64_t, float* out) {
      const auto n = static_cast<std::size_t>(size);
      const float mean = sum(x, n) / static_cast<float>(size);
      const float variance = sum_of_squares(x, mean, n) / static_cast<float>(size);
      normalise(x, mean, 1.0F / std::sqrt(variance + epsilon), weight.data<float>(), bias.data<float>(), n, out);
    };
    return {along_axis(engine, in[0], in[0].rank() - 1, row)};
  };
}

Step instance_normalization(const Site& site) {
  const float epsilon = site.number("epsilon", 1e-5F);
  const Array weight = as_row_major(site.engine.pool(), site.constant(1), Type::f32),
              bias = as_row_major(site.engine.pool(), site.constant(2), Type::f32);
  return [&engine = site.engine, epsilon, weight, bias](const Arrays& in) -> Arrays {
    const Dims& shape = in.at(0).shape;
    expect(shape.size() >= 3 && shape[1] == weight.count() && bias.count() == weight.count(),
           "InstanceNormalization of other channels");
    const Array a = as_row_major(engine.pool(), in[0], Type::f32), out = make_array(engine.pool(), Type::f32, shape);
    const std::int64_t size = a.count() / (shape[0] * shape[1]);
    for_each_row(engine, shape[0] * shape[1], size, [&](std::int64_t r) {
      const auto n = static_cast<std::size_t>(size);
      const float* x = a.data<float>() + r * size;
      const float mean = sum(x, n) / static_cast<float>(size);
      const float variance = sum_of_squares(x, mean, n) / static_cast<float>(size);
      const float factor = weight.data<float>()[r % shape[1]] / std::sqrt(variance + epsilon);
      const float shift = bias.data<float>()[r % shape[1]] - mean * factor;
      float* to = out.data<float>() + r * size;
      scale(x, factor, n, to);
      apply(Binary::add, to, 1, &shift, 0, n, to);
    });
    return {out};
  };
}

}  // namespace

void add_reduction_operators(Makers& makers) {
  makers.insert({{"ReduceMean", reduction<Reduction::mean>},
                 {"ReduceSum", reduction<Reduction::sum>},
                 {"ReduceMax", reduction<Reduction::maximum>},
                 {"ReduceMin", reduction<Reduction::minimum>},
                 {"ReduceL2", reduction<Reduction::l2>},
                 {"Softmax", softmax_step},
                 {"LogSoftmax", log_softmax},
                 {"LayerNormalization", layer_normalization},
                 {"InstanceNormalization", instance_normalization}});
}

}  // namespace demslam::nn
