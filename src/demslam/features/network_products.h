#pragma once

#include <compare>
#include <map>
#include <memory>
#include <mutex>

#include "demslam/features/network_engine.h"

namespace demslam::nn {

/// Rows of a left factor that are multiplied at a time, by one thread. Fixed, so that neither the number of rows nor
/// that of threads changes what is computed for a row.
inline constexpr std::int64_t kRowsAtATime = 128;

/// out = left x right (+ bias), float sums: left kRowsAtATime x depth, right depth x columns, both row-major, or
/// `right` given as columns x depth.
struct ProductShape {
  std::int64_t depth = 0, columns = 0;
  Type factors = Type::f32;
  bool right_transposed = false, with_bias = false;
  auto operator<=>(const ProductShape&) const = default;
};

/// oneDNN's matrix product of one shape; may be run by several threads at once.
class Product {
 public:
  /// `prepacked`: the right factor will be given in the primitive's own order, as pack() makes it.
  Product(const ProductShape& shape, bool prepacked);
  ~Product();

  /// The right factor in the primitive's own order, from float, depth x columns (or as `right_transposed` says).
  Array pack(Pool& pool, const Array& right) const;

  void run(const void* left, const void* right, const float* bias, float* out) const;

 private:
  struct Primitive;
  std::unique_ptr<Primitive> primitive_;
};

/// Products by their shape, made when first asked for.
class Products {
 public:
  const Product& get(const ProductShape& shape);

 private:
  std::mutex mutex_;
  std::map<ProductShape, std::unique_ptr<Product>> made_;
};

/// A layer with constant weights.
class Linear {
 public:
  /// Weights inputs x outputs (row-major float); bias of `outputs` floats or empty.
  Linear(Engine& engine, const Array& weights, const Array& bias);

  /// [..., inputs] -> [..., outputs].
  Array run(Engine& engine, const Array& in) const;

 private:
  std::int64_t inputs_, outputs_;
  Product product_;
  Array packed_, bias_;
};

/// Batched product of two arrays, the leading axes broadcast as numpy's matmul does.
Array multiply(Engine& engine, Products& products, const Array& left, const Array& right);

/// softmax(queries x keys) x values over the last axes, the scores never stored as a whole. Queries [..., N, D], keys
/// [..., D, M], values [..., M, E], leading axes equal.
Array attention(Engine& engine, Products& products, const Array& queries, const Array& keys, const Array& values);

}  // namespace demslam::nn
