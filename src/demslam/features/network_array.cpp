#include "demslam/features/network_array.h"

#include <algorithm>
#include <bit>
#include <new>
#include <numeric>
#include <optional>

#include "demslam/base/error.h"
#include "demslam/features/network_kernels.h"

namespace demslam::nn {
namespace {

constexpr std::size_t kAlignment = 64;

/// The next size of which there are four to a power of two: little is wasted and much fits again.
std::size_t shelf_size(std::size_t bytes) {
  if (bytes <= 256) return 256;
  const std::size_t step = std::max<std::size_t>(std::bit_floor(bytes - 1) / 4, 1);
  return (bytes + step - 1) / step * step;
}

float widened(std::uint16_t bits) { return std::bit_cast<float>(static_cast<std::uint32_t>(bits) << 16U); }

/// Element as the arithmetic type that stands for it.
float value_of(float v) { return v; }
float value_of(std::uint16_t v) { return widened(v); }
std::int64_t value_of(std::int64_t v) { return v; }
bool value_of(bool v) { return v; }

template <class To, class V>
To element_of(V value) {
  if constexpr (std::is_same_v<To, std::uint16_t>) {
    return to_bf16(static_cast<float>(value));
  } else if constexpr (std::is_same_v<To, bool>) {
    return value != V(0);
  } else {
    return static_cast<To>(value);
  }
}

/// One axis of a copy.
struct Axis {
  std::int64_t size, from, to;
};

/// Axes without those of size one, neighbours merged where both sides allow, the best order for the caches: innermost
/// runs along the target, the one around it along the source.
std::vector<Axis> copy_axes(const Array& from, const Array& to) {
  std::vector<Axis> axes;
  for (std::size_t i = 0; i < from.rank(); ++i) {
    if (from.shape[i] != 1) axes.push_back({from.shape[i], from.strides[i], to.strides[i]});
  }
  std::ranges::stable_sort(axes, std::greater<>(), [](const Axis& axis) { return std::abs(axis.to); });
  std::vector<Axis> merged;
  for (const Axis& axis : axes) {
    if (!merged.empty() && merged.back().from == axis.from * axis.size && merged.back().to == axis.to * axis.size) {
      merged.back() = {merged.back().size * axis.size, axis.from, axis.to};
    } else {
      merged.push_back(axis);
    }
  }
  if (merged.size() > 2) {
    const auto last = merged.end() - 1;
    const auto nearest = std::min_element(
        merged.begin(), last, [](const Axis& a, const Axis& b) { return std::abs(a.from) < std::abs(b.from); });
    std::rotate(nearest, nearest + 1, last);
  }
  while (merged.size() < 2) merged.insert(merged.begin(), {1, 0, 0});
  return merged;
}

template <class From, class To>
void copy_run(const From* from, std::int64_t from_step, To* to, std::int64_t to_step, std::int64_t count) {
  if (from_step == 1 && to_step == 1) {
    if constexpr (std::is_same_v<From, To>) {
      std::copy_n(from, count, to);
      return;
    } else if constexpr (std::is_same_v<From, float> && std::is_same_v<To, std::uint16_t>) {
      return floats_to_bf16(from, static_cast<std::size_t>(count), to);
    } else if constexpr (std::is_same_v<From, std::uint16_t> && std::is_same_v<To, float>) {
      return bf16_to_floats(from, static_cast<std::size_t>(count), to);
    }
  }
  for (std::int64_t i = 0; i < count; ++i) to[i * to_step] = element_of<To>(value_of(from[i * from_step]));
}

template <class From, class To>
void copy_elements(const From* from, To* to, const std::vector<Axis>& axes, std::size_t depth) {
  const Axis& axis = axes[depth];
  if (depth + 1 == axes.size()) return copy_run(from, axis.from, to, axis.to, axis.size);
  for (std::int64_t i = 0; i < axis.size; ++i) {
    copy_elements(from + i * axis.from, to + i * axis.to, axes, depth + 1);
  }
}

template <class From>
void copy_from(const Array& from, const Array& to, const std::vector<Axis>& axes) {
  const From* source = from.data<From>();
  switch (to.type) {
    case Type::f32:
      return copy_elements(source, to.data<float>(), axes, 0);
    case Type::bf16:
      return copy_elements(source, to.data<std::uint16_t>(), axes, 0);
    case Type::i64:
      return copy_elements(source, to.data<std::int64_t>(), axes, 0);
    case Type::boolean:
      return copy_elements(source, to.data<bool>(), axes, 0);
  }
}

/// Strides of the view of `a` in another shape of equal count, which is not zero; none where the elements would have to
/// move. Old and new axes are taken in groups of equal size, the old ones of which must lie as one.
std::optional<Dims> view_strides(const Array& a, const Dims& shape) {
  Dims sizes, steps, strides(shape.size(), 1);
  for (std::size_t i = 0; i < a.rank(); ++i) {
    if (a.shape[i] != 1) sizes.push_back(a.shape[i]), steps.push_back(a.strides[i]);
  }
  std::size_t first_old = 0, first_new = 0;
  while (first_old < sizes.size() && first_new < shape.size()) {
    std::size_t old = first_old + 1, fresh = first_new + 1;
    std::int64_t old_size = sizes[first_old], new_size = shape[first_new];
    while (old_size != new_size) (old_size < new_size ? old_size *= sizes[old++] : new_size *= shape[fresh++]);
    for (std::size_t k = first_old; k + 1 < old; ++k) {
      if (steps[k] != sizes[k + 1] * steps[k + 1]) return std::nullopt;
    }
    strides[fresh - 1] = steps[old - 1];
    for (std::size_t k = fresh - 1; k > first_new; --k) strides[k - 1] = strides[k] * shape[k];
    first_old = old;
    first_new = fresh;
  }
  return strides;
}

/// Axes of size one may have any stride.
bool is_laid_out(const Array& a, const Dims& strides) {
  for (std::size_t i = 0; i < a.rank(); ++i) {
    if (a.shape[i] != 1 && a.strides[i] != strides[i]) return false;
  }
  return true;
}

Array as_strided(Pool& pool, const Array& a, Type type, const Dims& strides) {
  Array result = a;
  result.strides = strides;
  if (a.type == type && is_laid_out(a, strides)) return result;
  result = make_array(pool, type, a.shape, strides);
  copy(a, result);
  return result;
}

}  // namespace

struct Pool::Shelves {
  std::mutex mutex;
  std::map<std::size_t, std::vector<std::byte*>> free;

  ~Shelves() {
    for (auto& [size, pieces] : free) {
      for (std::byte* piece : pieces) ::operator delete(piece, std::align_val_t(kAlignment));
    }
  }
};

std::shared_ptr<Pool::Shelves> Pool::make_shelves() { return std::make_shared<Shelves>(); }

std::shared_ptr<std::byte> Pool::allocate(std::size_t bytes) {
  const std::size_t size = shelf_size(bytes);
  std::byte* piece = nullptr;
  {
    const std::lock_guard lock(shelves_->mutex);
    if (auto& shelf = shelves_->free[size]; !shelf.empty()) {
      piece = shelf.back();
      shelf.pop_back();
    }
  }
  if (piece == nullptr) piece = static_cast<std::byte*>(::operator new(size, std::align_val_t(kAlignment)));
  return {piece, [shelves = shelves_, size](std::byte* done) {
            const std::lock_guard lock(shelves->mutex);
            shelves->free[size].push_back(done);
          }};
}

std::size_t size_of(Type type) {
  switch (type) {
    case Type::f32:
      return 4;
    case Type::bf16:
      return 2;
    case Type::i64:
      return 8;
    case Type::boolean:
      return 1;
  }
  return 0;
}

std::int64_t count_of(const Dims& shape) {
  return std::accumulate(shape.begin(), shape.end(), std::int64_t{1}, std::multiplies<>());
}

std::int64_t Array::count() const { return count_of(shape); }

Dims row_major(const Dims& shape) {
  Dims strides(shape.size(), 1);
  for (std::size_t i = shape.size(); i-- > 1;) strides[i - 1] = strides[i] * shape[i];
  return strides;
}

Dims channels_last(const Dims& shape) { return {shape[1] * shape[2] * shape[3], 1, shape[1] * shape[3], shape[1]}; }

Array make_array(Pool& pool, Type type, Dims shape) {
  Dims strides = row_major(shape);
  return make_array(pool, type, std::move(shape), std::move(strides));
}

Array make_array(Pool& pool, Type type, Dims shape, Dims strides) {
  const auto memory = pool.allocate(static_cast<std::size_t>(count_of(shape)) * size_of(type));
  return {type, std::move(shape), std::move(strides), memory, memory.get()};
}

bool is_row_major(const Array& a) { return is_laid_out(a, row_major(a.shape)); }

bool is_dense(const Array& a) {
  std::vector<std::pair<std::int64_t, std::int64_t>> axes;  // stride, size
  for (std::size_t i = 0; i < a.rank(); ++i) {
    if (a.shape[i] != 1) axes.emplace_back(a.strides[i], a.shape[i]);
  }
  std::ranges::sort(axes);
  std::int64_t expected = 1;
  for (const auto& [stride, size] : axes) {
    if (stride != expected) return false;
    expected *= size;
  }
  return true;
}

void copy(const Array& from, const Array& to) {
  if (from.count() == 0) return;
  const std::vector<Axis> axes = copy_axes(from, to);
  switch (from.type) {
    case Type::f32:
      return copy_from<float>(from, to, axes);
    case Type::bf16:
      return copy_from<std::uint16_t>(from, to, axes);
    case Type::i64:
      return copy_from<std::int64_t>(from, to, axes);
    case Type::boolean:
      return copy_from<bool>(from, to, axes);
  }
}

Array as_row_major(Pool& pool, const Array& a, Type type) { return as_strided(pool, a, type, row_major(a.shape)); }

Array as_channels_last(Pool& pool, const Array& a, Type type) {
  return as_strided(pool, a, type, channels_last(a.shape));
}

Array reshaped(Pool& pool, const Array& a, const Dims& shape) {
  if (count_of(shape) != a.count()) throw Error("a tensor cannot be reshaped to another number of values");
  const auto strides = a.count() == 0 ? std::nullopt : view_strides(a, shape);
  Array view = strides ? a : as_row_major(pool, a, a.type);
  view.shape = shape;
  view.strides = strides.value_or(row_major(shape));
  return view;
}

std::size_t axis_of(std::int64_t axis, std::size_t rank) {
  const auto size = static_cast<std::int64_t>(rank);
  if (axis < -size || axis >= size) throw Error("a tensor has no axis " + std::to_string(axis));
  return static_cast<std::size_t>(axis < 0 ? axis + size : axis);
}

std::vector<std::int64_t> integers_of(const Array& a) {
  Pool pool;
  const Array dense = as_row_major(pool, a, Type::i64);
  return {dense.data<std::int64_t>(), dense.data<std::int64_t>() + dense.count()};
}

}  // namespace demslam::nn
