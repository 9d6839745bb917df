#pragma once

#include <algorithm>
#include <dnnl.hpp>
#include <unordered_map>

#include "demslam/features/network_array.h"

namespace demslam::nn {

// What the files that call oneDNN share.

const dnnl::engine& cpu();
/// This thread's.
const dnnl::stream& stream();

dnnl::memory::data_type data_type(Type type);

/// Scratch memory is given by the caller, so that a primitive can run on several threads at once.
dnnl::primitive_attr own_scratch();
/// This thread's, large enough.
dnnl::memory scratch_memory(const dnnl::memory::desc& size);

/// oneDNN takes pointers that it may write to; inputs it only reads.
dnnl::memory on_memory(const dnnl::memory::desc& description, const void* start);

/// The elements of a float array, in the order and type that `to` asks for.
Array reordered(Pool& pool, const Array& from, const dnnl::memory::desc& as, const dnnl::memory::desc& to);

/// Memory of this thread for a step's intermediate results, given back at the end of the scope.
class Scratch {
 public:
  explicit Scratch(std::int64_t bytes) : bytes_(bytes), memory_(pool().allocate(static_cast<std::size_t>(bytes))) {}

  std::byte* data() const { return memory_.get(); }
  float* floats() const { return reinterpret_cast<float*>(memory_.get()); }
  /// Zeros from here to the end.
  void clear_from(std::int64_t first) const { std::fill(data() + first, data() + bytes_, std::byte{0}); }

 private:
  static Pool& pool();
  std::int64_t bytes_;
  std::shared_ptr<std::byte> memory_;
};

}  // namespace demslam::nn
