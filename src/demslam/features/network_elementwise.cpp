#include <algorithm>
#include <array>
#include <cmath>

#include "demslam/features/network_kernels.h"
#include "demslam/features/network_operators.h"

namespace demslam::nn {
namespace {

constexpr std::int64_t kBlock = 1024;             ///< values that are widened at a time
constexpr std::int64_t kValuesPerTask = 1 << 15;  ///< for one thread

/// Calls work(first, count) for runs that cover 0 ... total - 1.
template <class Work>
void in_blocks(Engine& engine, std::int64_t total, std::int64_t per_task, const Work& work) {
  engine.parallel((total + per_task - 1) / per_task,
                  [&](std::int64_t i) { work(i * per_task, std::min(per_task, total - i * per_task)); });
}

/// Values of a dense float or bfloat16 array as floats, `count` of them from `first`; `room` takes widened ones.
const float* floats_at(const Array& a, std::int64_t first, std::int64_t count, float* room) {
  if (a.type == Type::f32) return a.data<float>() + first;
  bf16_to_floats(a.data<std::uint16_t>() + first, static_cast<std::size_t>(count), room);
  return room;
}

bool is_float(const Array& a) { return a.type == Type::f32 || a.type == Type::bf16; }

/// A float or bfloat16 array that fills its memory, in whatever order of axes.
Array as_dense_floats(Engine& engine, const Array& a) {
  return is_float(a) && is_dense(a) ? a : as_row_major(engine.pool(), a, Type::f32);
}

/// work(in, count, out) on runs of floats of a dense array.
template <class Work>
Array mapped(Engine& engine, const Array& input, const Work& work) {
  const Array in = as_dense_floats(engine, input);
  const Array out = make_array(engine.pool(), in.type, in.shape, in.strides);
  in_blocks(engine, in.count(), kValuesPerTask, [&](std::int64_t start, std::int64_t total) {
    if (in.type == Type::f32) {
      return work(in.data<float>() + start, static_cast<std::size_t>(total), out.data<float>() + start);
    }
    std::array<float, kBlock> room;
    for (std::int64_t i = start; i < start + total; i += kBlock) {
      const std::int64_t count = std::min(kBlock, start + total - i);
      work(floats_at(in, i, count, room.data()), static_cast<std::size_t>(count), room.data());
      floats_to_bf16(room.data(), static_cast<std::size_t>(count), out.data<std::uint16_t>() + i);
    }
  });
  return out;
}

Dims broadcast_shape(const Dims& a, const Dims& b) {
  Dims shape(std::max(a.size(), b.size()), 1);
  for (const Dims* part : {&a, &b}) {
    const std::size_t offset = shape.size() - part->size();
    for (std::size_t i = 0; i < part->size(); ++i) {
      std::int64_t& size = shape[offset + i];
      expect(size == 1 || (*part)[i] == 1 || size == (*part)[i], "tensors of shapes that do not go together");
      if (size == 1) size = (*part)[i];
    }
  }
  return shape;
}

/// A view of the array in a shape it broadcasts to.
Array broadcast(const Array& a, const Dims& shape) {
  Array view = a;
  view.shape = shape;
  view.strides.assign(shape.size(), 0);
  const std::size_t offset = shape.size() - a.rank();
  for (std::size_t i = 0; i < a.rank(); ++i) {
    if (a.shape[i] != 1) view.strides[offset + i] = a.strides[i];
  }
  return view;
}

/// Two arrays of one layout, whose memory can be gone through in step.
Array combined_in_step(Engine& engine, Binary function, const Array& a, const Array& b) {
  const Array out = make_array(engine.pool(), a.type == b.type ? a.type : Type::f32, a.shape, a.strides);
  in_blocks(engine, a.count(), kValuesPerTask, [&](std::int64_t start, std::int64_t total) {
    std::array<float, kBlock> room_a, room_b;
    for (std::int64_t i = start; i < start + total; i += kBlock) {
      const std::int64_t count = std::min(kBlock, start + total - i);
      const auto n = static_cast<std::size_t>(count);
      const float *x = floats_at(a, i, count, room_a.data()), *y = floats_at(b, i, count, room_b.data());
      if (out.type == Type::f32) {
        apply(function, x, 1, y, 1, n, out.data<float>() + i);
      } else {
        apply(function, x, 1, y, 1, n, room_a.data());
        floats_to_bf16(room_a.data(), n, out.data<std::uint16_t>() + i);
      }
    }
  });
  return out;
}

/// The innermost axis of a broadcast operand, as a run that the kernels take.
struct Run {
  const float* start;
  std::size_t step;
};

Run run_of(const float* start, std::int64_t stride, std::int64_t count, float* room) {
  if (stride == 0 || stride == 1) return {start, static_cast<std::size_t>(stride)};
  for (std::int64_t i = 0; i < count; ++i) room[i] = start[i * stride];
  return {room, 1};
}

/// Merges axes of both operands where neither minds, so that runs get long.
void merge_axes(Array& a, Array& b) {
  Dims shape, steps_a, steps_b;
  for (std::size_t i = 0; i < a.rank(); ++i) {
    const std::int64_t size = a.shape[i];
    if (size == 1) continue;
    if (!shape.empty() && steps_a.back() == a.strides[i] * size && steps_b.back() == b.strides[i] * size) {
      shape.back() *= size;
      steps_a.back() = a.strides[i];
      steps_b.back() = b.strides[i];
    } else {
      shape.push_back(size);
      steps_a.push_back(a.strides[i]);
      steps_b.push_back(b.strides[i]);
    }
  }
  if (shape.empty()) shape = {1}, steps_a = steps_b = {0};
  a.shape = b.shape = shape;
  a.strides = steps_a;
  b.strides = steps_b;
}

/// Where row `index` begins, the rows being counted over all axes but the last.
std::int64_t row_offset(const Array& a, std::int64_t index) {
  std::int64_t offset = 0;
  for (std::size_t k = a.rank() - 1; k-- > 0;) {
    offset += index % a.shape[k] * a.strides[k];
    index /= a.shape[k];
  }
  return offset;
}

Array as_floats(Engine& engine, const Array& a) {
  return a.type == Type::f32 ? a : as_row_major(engine.pool(), a, Type::f32);
}

Array combined(Engine& engine, Binary function, const Array& left, const Array& right) {
  const bool in_step = left.shape == right.shape && left.strides == right.strides && is_dense(left);
  if (in_step && is_float(left) && is_float(right)) return combined_in_step(engine, function, left, right);
  const Dims shape = broadcast_shape(left.shape, right.shape);
  const Array out = make_array(engine.pool(), Type::f32, shape);
  if (out.count() == 0) return out;
  Array a = broadcast(as_floats(engine, left), shape), b = broadcast(as_floats(engine, right), shape);
  merge_axes(a, b);
  const std::int64_t width = a.shape.back(), rows = out.count() / width, per_task = kValuesPerTask / width + 1;
  in_blocks(engine, rows, per_task, [&](std::int64_t first, std::int64_t count) {
    std::array<float, kBlock> room_a, room_b;
    for (std::int64_t r = first; r < first + count; ++r) {
      const float *x = a.data<float>() + row_offset(a, r), *y = b.data<float>() + row_offset(b, r);
      for (std::int64_t i = 0; i < width; i += kBlock) {
        const std::int64_t n = std::min(kBlock, width - i);
        const Run p = run_of(x + i * a.strides.back(), a.strides.back(), n, room_a.data()),
                  q = run_of(y + i * b.strides.back(), b.strides.back(), n, room_b.data());
        apply(function, p.start, p.step, q.start, q.step, static_cast<std::size_t>(n),
              out.data<float>() + r * width + i);
      }
    }
  });
  return out;
}

/// Element-wise work that is rare or small: both operands laid out in the result's shape, one value after the other.
template <class In, class Out, class Function>
Array combined_plainly(Engine& engine, Type in, Type out_type, const Array& left, const Array& right,
                       const Function& function) {
  const Dims shape = broadcast_shape(left.shape, right.shape);
  const Array a = as_row_major(engine.pool(), broadcast(left, shape), in),
              b = as_row_major(engine.pool(), broadcast(right, shape), in);
  const Array out = make_array(engine.pool(), out_type, shape);
  const std::int64_t count = out.count();
  const In *x = a.data<In>(), *y = b.data<In>();
  for (std::int64_t i = 0; i < count; ++i) out.data<Out>()[i] = static_cast<Out>(function(x[i], y[i]));
  return out;
}

std::int64_t integer_result(Binary function, std::int64_t a, std::int64_t b) {
  switch (function) {
    case Binary::add:
      return a + b;
    case Binary::subtract:
      return a - b;
    case Binary::multiply:
      return a * b;
    case Binary::divide:
      expect(b != 0 && b != -1, "an integer division by zero or minus one");
      return a / b;
    case Binary::maximum:
      return std::max(a, b);
    case Binary::minimum:
      return std::min(a, b);
  }
  return 0;
}

template <Binary function>
Step binary(const Site& site) {
  return [&engine = site.engine](const Arrays& in) -> Arrays {
    Array result = in.at(0);
    for (std::size_t i = 1; i < in.size(); ++i) {
      if (is_float(result) || is_float(in[i])) {
        result = combined(engine, function, result, in[i]);
      } else {
        result = combined_plainly<std::int64_t, std::int64_t>(
            engine, Type::i64, Type::i64, result, in[i],
            [](std::int64_t a, std::int64_t b) { return integer_result(function, a, b); });
      }
    }
    return {result};
  };
}

template <Unary function>
Step unary(const Site& site) {
  return [&engine = site.engine](const Arrays& in) -> Arrays {
    return {mapped(engine, in.at(0), [](const float* x, std::size_t n, float* out) { apply(function, x, n, out); })};
  };
}

/// A function of the standard library, value by value.
template <float (*function)(float)>
Step plain(const Site& site) {
  return [&engine = site.engine](const Arrays& in) -> Arrays {
    return {mapped(engine, in.at(0), [](const float* x, std::size_t n, float* out) {
      for (std::size_t i = 0; i < n; ++i) out[i] = function(x[i]);
    })};
  };
}

/// As unary(), but integers stay integers.
Step negate(const Site& site) {
  return [&engine = site.engine, floats = unary<Unary::negate>(site)](const Arrays& in) -> Arrays {
    if (is_float(in.at(0))) return floats(in);
    const Array zero = integer_array(engine.pool(), {0});
    return {combined_plainly<std::int64_t, std::int64_t>(engine, Type::i64, Type::i64, in[0],
                                                         reshaped(engine.pool(), zero, {}),
                                                         [](std::int64_t a, std::int64_t) { return -a; })};
  };
}

template <class Compare>
Step comparison(const Site& site) {
  return [&engine = site.engine](const Arrays& in) -> Arrays {
    const Array &a = in.at(0), &b = in.at(1);
    if (is_float(a) || is_float(b)) {
      return {combined_plainly<float, bool>(engine, Type::f32, Type::boolean, a, b, Compare())};
    }
    return {combined_plainly<std::int64_t, bool>(engine, Type::i64, Type::boolean, a, b, Compare())};
  };
}

template <class Function>
Step logic(const Site& site) {
  return [&engine = site.engine](const Arrays& in) -> Arrays {
    return {combined_plainly<bool, bool>(engine, Type::boolean, Type::boolean, in.at(0), in.at(1), Function())};
  };
}

Step logical_not(const Site& site) {
  return [&engine = site.engine](const Arrays& in) -> Arrays {
    return {combined_plainly<bool, bool>(engine, Type::boolean, Type::boolean, in.at(0), in.at(0),
                                         [](bool a, bool) { return !a; })};
  };
}

Step power(const Site& site) {
  return [&engine = site.engine](const Arrays& in) -> Arrays {
    return {combined_plainly<float, float>(engine, Type::f32, Type::f32, in.at(0), in.at(1),
                                           [](float a, float b) { return b == 2.0F ? a * a : std::pow(a, b); })};
  };
}

template <class T>
Array chosen(Engine& engine, Type type, const Array& which, const Array& yes, const Array& no) {
  const Dims shape = broadcast_shape(which.shape, broadcast_shape(yes.shape, no.shape));
  const auto laid_out = [&](const Array& a, Type t) { return as_row_major(engine.pool(), broadcast(a, shape), t); };
  const Array c = laid_out(which, Type::boolean), x = laid_out(yes, type), y = laid_out(no, type);
  const Array out = make_array(engine.pool(), type, shape);
  const std::int64_t count = out.count();
  for (std::int64_t i = 0; i < count; ++i) {
    out.data<T>()[i] = c.data<bool>()[i] ? x.data<T>()[i] : y.data<T>()[i];
  }
  return out;
}

Step where(const Site& site) {
  return [&engine = site.engine](const Arrays& in) -> Arrays {
    const Array &which = in.at(0), &yes = in.at(1), &no = in.at(2);
    if (is_float(yes) || is_float(no)) return {chosen<float>(engine, Type::f32, which, yes, no)};
    if (yes.type == Type::boolean) return {chosen<bool>(engine, Type::boolean, which, yes, no)};
    return {chosen<std::int64_t>(engine, Type::i64, which, yes, no)};
  };
}

Step clip(const Site& site) {
  return [&engine = site.engine](const Arrays& in) -> Arrays {
    Array result = in.at(0);
    expect(is_float(result), "Clip of integers");
    if (in.size() > 1 && in[1]) result = combined(engine, Binary::maximum, result, in[1]);
    if (in.size() > 2 && in[2]) result = combined(engine, Binary::minimum, result, in[2]);
    return {result};
  };
}

Step cast(const Site& site) {
  enum { kFloat = 1, kInt32 = 6, kInt64 = 7, kBool = 9, kHalf = 10, kDouble = 11 };
  const std::int64_t to = site.integer("to", 0);
  const bool floats = to == kFloat || to == kHalf || to == kDouble;
  site.require(floats || to == kInt32 || to == kInt64 || to == kBool, "type " + std::to_string(to));
  const Type type = floats ? Type::f32 : (to == kBool ? Type::boolean : Type::i64);
  return [&engine = site.engine, type](const Arrays& in) -> Arrays {
    const bool same = in.at(0).type == type || (type == Type::f32 && in[0].type == Type::bf16);
    return {same ? in[0] : as_row_major(engine.pool(), in[0], type)};
  };
}

}  // namespace

void add_elementwise_operators(Makers& makers) {
  makers.insert({{"Add", binary<Binary::add>},
                 {"Sub", binary<Binary::subtract>},
                 {"Mul", binary<Binary::multiply>},
                 {"Div", binary<Binary::divide>},
                 {"Max", binary<Binary::maximum>},
                 {"Min", binary<Binary::minimum>},
                 {"Sum", binary<Binary::add>},
                 {"Relu", unary<Unary::relu>},
                 {"Sigmoid", unary<Unary::sigmoid>},
                 {"Exp", unary<Unary::exp>},
                 {"Erf", unary<Unary::erf>},
                 {"Sqrt", unary<Unary::sqrt>},
                 {"Reciprocal", unary<Unary::reciprocal>},
                 {"Abs", unary<Unary::abs>},
                 {"Neg", negate},
                 {"demslam.Gelu", unary<Unary::gelu>},
                 {"Log", plain<std::log>},
                 {"Sin", plain<std::sin>},
                 {"Cos", plain<std::cos>},
                 {"Tanh", plain<std::tanh>},
                 {"Floor", plain<std::floor>},
                 {"Ceil", plain<std::ceil>},
                 {"Pow", power},
                 {"Equal", comparison<std::equal_to<>>},
                 {"Greater", comparison<std::greater<>>},
                 {"GreaterOrEqual", comparison<std::greater_equal<>>},
                 {"Less", comparison<std::less<>>},
                 {"LessOrEqual", comparison<std::less_equal<>>},
                 {"And", logic<std::logical_and<>>},
                 {"Or", logic<std::logical_or<>>},
                 {"Not", logical_not},
                 {"Where", where},
                 {"Clip", clip},
                 {"Cast", cast}});
}

}  // namespace demslam::nn
