#include "demslam/features/network_products.h"

#include <algorithm>
#include <dnnl.hpp>

#include "demslam/base/error.h"
#include "demslam/features/internal/dnnl_support.h"
#include "demslam/features/network_kernels.h"

namespace demslam::nn {
namespace {

using dnnl::memory;
using Tag = memory::format_tag;

constexpr std::int64_t kColumnStep = 64;  ///< right factors that change are padded to multiples of it

std::int64_t padded(std::int64_t size) { return (size + kColumnStep - 1) / kColumnStep * kColumnStep; }

dnnl::matmul::primitive_desc describe(const ProductShape& shape, bool prepacked) {
  const Tag right = prepacked ? Tag::any : (shape.right_transposed ? Tag::ba : Tag::ab);
  const memory::desc a({kRowsAtATime, shape.depth}, data_type(shape.factors), Tag::ab);
  const memory::desc b({shape.depth, shape.columns}, data_type(shape.factors), right);
  const memory::desc c({kRowsAtATime, shape.columns}, memory::data_type::f32, Tag::ab);
  const memory::desc bias({1, shape.columns}, memory::data_type::f32, Tag::ab);
  if (shape.with_bias) return {cpu(), a, b, bias, c, own_scratch()};
  return {cpu(), a, b, c, own_scratch()};
}

/// The matrix of the last two axes at place `index` of the leading ones.
Array matrix_at(const Array& a, const Dims& batch, std::int64_t index) {
  Array matrix{a.type, {a.shape.end() - 2, a.shape.end()}, {a.strides.end() - 2, a.strides.end()}, a.memory, a.start};
  const std::size_t leading = a.rank() - 2;
  for (std::size_t k = batch.size(); k-- > 0;) {
    const std::int64_t place = index % batch[k];
    index /= batch[k];
    const std::size_t behind = batch.size() - k;  // axes align at their ends
    if (behind > leading || a.shape[leading - behind] == 1) continue;
    matrix.start += place * a.strides[leading - behind] * static_cast<std::int64_t>(size_of(a.type));
  }
  return matrix;
}

Array rows_of(const Array& matrix, std::int64_t first, std::int64_t count) {
  Array rows = matrix;
  rows.shape[0] = count;
  rows.start += first * matrix.strides[0] * static_cast<std::int64_t>(size_of(matrix.type));
  return rows;
}

/// A row-major copy of `from` at `start`, `width` elements to the row.
void place(const Array& from, Type type, std::int64_t width, std::byte* start) {
  copy(from, {type, from.shape, {width, 1}, from.memory, start});
}

/// The matrix as the factor of a product: padded with zeros to rows x columns, or its transpose where it lies so.
struct Factor {
  Array array;
  bool transposed = false;
};

Factor as_factor(Engine& engine, const Array& matrix, std::int64_t rows, std::int64_t columns) {
  const bool transposed = matrix.strides[0] == 1 && matrix.strides[1] != 1;
  Array from = matrix;
  if (transposed) {
    std::swap(from.shape[0], from.shape[1]);
    std::swap(from.strides[0], from.strides[1]);
    std::swap(rows, columns);
  }
  Array to = make_array(engine.pool(), engine.factor_type(), {rows, columns});
  const std::int64_t bytes = to.count() * static_cast<std::int64_t>(size_of(to.type));
  if (from.shape != to.shape) std::fill_n(to.start, bytes, std::byte{0});
  place(from, to.type, columns, to.start);
  return {to, transposed};
}

Dims broadcast_batch(const Array& left, const Array& right) {
  Dims batch(std::max(left.rank(), right.rank()) - 2, 1);
  for (const Array* a : {&left, &right}) {
    const std::size_t offset = batch.size() - (a->rank() - 2);
    for (std::size_t k = 0; k + 2 < a->rank(); ++k) {
      std::int64_t& size = batch[offset + k];
      if (size != 1 && a->shape[k] != 1 && size != a->shape[k]) throw Error("matrix products of unequal batches");
      size = std::max(size, a->shape[k]);
    }
  }
  return batch;
}

std::int64_t groups_of(std::int64_t rows) { return (rows + kRowsAtATime - 1) / kRowsAtATime; }

}  // namespace

struct Product::Primitive {
  dnnl::matmul::primitive_desc description;
  dnnl::matmul primitive;
  memory::desc left, right, bias, out, scratch;

  explicit Primitive(const dnnl::matmul::primitive_desc& d)
      : description(d),
        primitive(d),
        left(d.src_desc()),
        right(d.weights_desc()),
        bias(d.bias_desc()),
        out(d.dst_desc()),
        scratch(d.scratchpad_desc()) {}
};

Product::Product(const ProductShape& shape, bool prepacked)
    : primitive_(std::make_unique<Primitive>(describe(shape, prepacked))) {}
Product::~Product() = default;

Array Product::pack(Pool& pool, const Array& right) const {
  const auto dims = primitive_->right.get_dims();
  return reordered(pool, right, memory::desc(dims, memory::data_type::f32, Tag::ab), primitive_->right);
}

void Product::run(const void* left, const void* right, const float* bias, float* out) const {
  const Primitive& p = *primitive_;
  std::unordered_map<int, memory> arguments{{DNNL_ARG_SRC, on_memory(p.left, left)},
                                            {DNNL_ARG_WEIGHTS, on_memory(p.right, right)},
                                            {DNNL_ARG_DST, on_memory(p.out, out)},
                                            {DNNL_ARG_SCRATCHPAD, scratch_memory(p.scratch)}};
  if (bias != nullptr) arguments.emplace(DNNL_ARG_BIAS, on_memory(p.bias, bias));
  p.primitive.execute(stream(), arguments);
}

const Product& Products::get(const ProductShape& shape) {
  const std::lock_guard lock(mutex_);
  auto& product = made_[shape];
  if (!product) product = std::make_unique<Product>(shape, false);
  return *product;
}

Linear::Linear(Engine& engine, const Array& weights, const Array& bias)
    : inputs_(weights.shape[0]),
      outputs_(weights.shape[1]),
      product_({inputs_, outputs_, engine.factor_type(), false, static_cast<bool>(bias)}, true),
      packed_(product_.pack(engine.pool(), as_row_major(engine.pool(), weights, Type::f32))) {
  if (bias) bias_ = as_row_major(engine.pool(), bias, Type::f32);
}

Array Linear::run(Engine& engine, const Array& in) const {
  Dims shape = in.shape;
  shape.back() = outputs_;
  const Array rows = reshaped(engine.pool(), in, {in.count() / inputs_, inputs_});
  const std::int64_t count = rows.shape[0];
  Array out = make_array(engine.pool(), Type::f32, shape);
  const float* bias = bias_ ? bias_.data<float>() : nullptr;
  const std::size_t size = size_of(engine.factor_type());
  engine.parallel(groups_of(count), [&](std::int64_t group) {
    const std::int64_t first = group * kRowsAtATime, some = std::min(kRowsAtATime, count - first);
    Scratch left(kRowsAtATime * inputs_ * size),
        rest(some < kRowsAtATime ? kRowsAtATime * outputs_ * sizeof(float) : 0);
    place(rows_of(rows, first, some), engine.factor_type(), inputs_, left.data());
    left.clear_from(some * inputs_ * size);
    float* target = out.data<float>() + first * outputs_;
    if (some == kRowsAtATime) return product_.run(left.data(), packed_.start, bias, target);
    product_.run(left.data(), packed_.start, bias, rest.floats());
    std::copy_n(rest.floats(), some * outputs_, target);
  });
  return out;
}

Array multiply(Engine& engine, Products& products, const Array& left, const Array& right) {
  const std::int64_t rows = left.shape.end()[-2], depth = left.shape.back(), columns = right.shape.back();
  if (right.shape.end()[-2] != depth) throw Error("matrix product of unequal depths");
  const Dims batch = broadcast_batch(left, right);
  Dims shape = batch;
  shape.insert(shape.end(), {rows, columns});
  Array out = make_array(engine.pool(), Type::f32, shape);
  const std::int64_t wide = padded(columns);
  const std::size_t size = size_of(engine.factor_type());
  for (std::int64_t b = 0; b < count_of(batch); ++b) {
    const Array a = matrix_at(left, batch, b), c = matrix_at(out, batch, b);
    const Factor factor = as_factor(engine, matrix_at(right, batch, b), depth, wide);
    const Product& product = products.get({depth, wide, engine.factor_type(), factor.transposed, false});
    engine.parallel(groups_of(rows), [&](std::int64_t group) {
      const std::int64_t first = group * kRowsAtATime, some = std::min(kRowsAtATime, rows - first);
      Scratch part(kRowsAtATime * depth * size), result(kRowsAtATime * wide * sizeof(float));
      place(rows_of(a, first, some), engine.factor_type(), depth, part.data());
      part.clear_from(some * depth * size);
      product.run(part.data(), factor.array.start, nullptr, result.floats());
      for (std::int64_t i = 0; i < some; ++i) {
        std::copy_n(result.floats() + i * wide, columns, c.data<float>() + (first + i) * columns);
      }
    });
  }
  return out;
}

namespace {

/// The attention of some rows of queries, with one batch's keys and values.
struct AttentionGroup {
  const Product &scoring, &summing;
  const Factor &keys, &values;
  std::int64_t known;  ///< keys; the rest is padding
  std::int64_t wide, depth, width;
  Type type;

  void run(const Array& queries, float* out) const;
};

/// Row by row exp(score - best), which `weights` receives as a factor; the padding gets no weight. Gives the sum.
float weigh(const float* scores, std::int64_t known, std::int64_t wide, Type type, std::byte* weights) {
  const float best = largest(scores, static_cast<std::size_t>(known));
  const auto size = static_cast<std::int64_t>(size_of(type));
  std::fill(weights + known * size, weights + wide * size, std::byte{0});
  const auto count = static_cast<std::size_t>(known);
  if (type == Type::f32) return shifted_exp(scores, best, count, reinterpret_cast<float*>(weights));
  return shifted_exp(scores, best, count, reinterpret_cast<std::uint16_t*>(weights));
}

void AttentionGroup::run(const Array& queries, float* out) const {
  const auto size = static_cast<std::int64_t>(size_of(type));
  const std::int64_t some = queries.shape[0];
  Scratch left(kRowsAtATime * depth * size), scores(kRowsAtATime * wide * sizeof(float)),
      weights(kRowsAtATime * wide * size), result(kRowsAtATime * width * sizeof(float));
  place(queries, type, depth, left.data());
  left.clear_from(some * depth * size);
  scoring.run(left.data(), keys.array.start, nullptr, scores.floats());
  std::array<float, kRowsAtATime> sums{};
  for (std::int64_t i = 0; i < some; ++i) {
    sums[i] = weigh(scores.floats() + i * wide, known, wide, type, weights.data() + i * wide * size);
  }
  weights.clear_from(some * wide * size);
  summing.run(weights.data(), values.array.start, nullptr, result.floats());
  for (std::int64_t i = 0; i < some; ++i) {
    scale(result.floats() + i * width, 1.0F / sums[i], static_cast<std::size_t>(width), out + i * width);
  }
}

}  // namespace

Array attention(Engine& engine, Products& products, const Array& queries, const Array& keys, const Array& values) {
  const std::int64_t rows = queries.shape.end()[-2], depth = queries.shape.back(), known = keys.shape.back(),
                     wide = padded(known), width = values.shape.back();
  const Dims batch(queries.shape.begin(), queries.shape.end() - 2);
  Dims shape = batch;
  shape.insert(shape.end(), {rows, width});
  Array out = make_array(engine.pool(), Type::f32, shape);
  for (std::int64_t b = 0; b < count_of(batch); ++b) {
    const Factor key_factor = as_factor(engine, matrix_at(keys, batch, b), depth, wide),
                 value_factor = as_factor(engine, matrix_at(values, batch, b), wide, width);
    const Type type = engine.factor_type();
    const AttentionGroup group{products.get({depth, wide, type, key_factor.transposed, false}),
                               products.get({wide, width, type, value_factor.transposed, false}),
                               key_factor,
                               value_factor,
                               known,
                               wide,
                               depth,
                               width,
                               type};
    const Array q = matrix_at(queries, batch, b), o = matrix_at(out, batch, b);
    engine.parallel(groups_of(rows), [&](std::int64_t g) {
      const std::int64_t first = g * kRowsAtATime;
      group.run(rows_of(q, first, std::min(kRowsAtATime, rows - first)), o.data<float>() + first * width);
    });
  }
  return out;
}

}  // namespace demslam::nn
