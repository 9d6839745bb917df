#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

namespace demslam::nn {

using Dims = std::vector<std::int64_t>;
enum class Type { f32, bf16, i64, boolean };
std::size_t size_of(Type type);

/// Memory that is used again: what one network needs for a run it needs for the next. Aligned to 64 bytes, not zeroed.
class Pool {
 public:
  std::shared_ptr<std::byte> allocate(std::size_t bytes);

 private:
  struct Shelves;
  std::shared_ptr<Shelves> shelves_ = make_shelves();
  static std::shared_ptr<Shelves> make_shelves();
};

/// A tensor, or a view of one: element (i, j, ...) stands at data[i * strides[0] + j * strides[1] + ...]. Transposing,
/// slicing and adding axes make views and move nothing. Contents are not changed once another node can see them.
struct Array {
  Type type = Type::f32;
  Dims shape, strides;  ///< strides in elements
  std::shared_ptr<std::byte> memory;
  std::byte* start = nullptr;

  template <class T>
  T* data() const {
    return reinterpret_cast<T*>(start);
  }
  explicit operator bool() const { return memory != nullptr; }
  std::size_t rank() const { return shape.size(); }
  std::int64_t count() const;
};

std::int64_t count_of(const Dims& shape);
Dims row_major(const Dims& shape);
/// Strides of an image [N,C,H,W] whose channels lie side by side: what convolutions like best.
Dims channels_last(const Dims& shape);

Array make_array(Pool& pool, Type type, Dims shape);
Array make_array(Pool& pool, Type type, Dims shape, Dims strides);

bool is_row_major(const Array& a);
/// The elements fill a run of memory, in whatever order of axes: element-wise work may then go straight through it.
bool is_dense(const Array& a);

/// Copies elements between views of equal shape, converting the type (floats to integers towards zero, to boolean by
/// being other than zero).
void copy(const Array& from, const Array& to);

/// The array itself if it is so already, else a copy.
Array as_row_major(Pool& pool, const Array& a, Type type);
Array as_channels_last(Pool& pool, const Array& a, Type type);

/// The same elements in another shape of equal count, in row-major order; a view where the strides allow.
Array reshaped(Pool& pool, const Array& a, const Dims& shape);

/// Axis from the end when negative; throws Error when there is no such axis.
std::size_t axis_of(std::int64_t axis, std::size_t rank);

/// Row-major values of an integer or boolean array.
std::vector<std::int64_t> integers_of(const Array& a);

}  // namespace demslam::nn
