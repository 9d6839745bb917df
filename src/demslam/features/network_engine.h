#pragma once

#include <functional>
#include <memory>

#include "demslam/features/network_array.h"

namespace demslam::nn {

/// oneDNN would divide its work by the number of OpenMP threads and thereby change the order of its sums; while this
/// lives, what the present thread makes and runs is for one thread.
class OneOpenMpThread {
 public:
  OneOpenMpThread();
  ~OneOpenMpThread();
  OneOpenMpThread(const OneOpenMpThread&) = delete;

 private:
  int before_;
};

/// What the steps of one network share: memory, threads and the precision of its products.
class Engine {
 public:
  /// `bf16`: products take bfloat16 factors and sum in float; else all is float.
  Engine(int threads, bool bf16);
  ~Engine();

  Pool& pool() { return pool_; }
  Type factor_type() const { return bf16_ ? Type::bf16 : Type::f32; }

  /// Runs work(0) ... work(count - 1), each on one thread. What is computed must not depend on the number of threads:
  /// callers divide their work by its size alone.
  void parallel(std::int64_t count, const std::function<void(std::int64_t)>& work);

 private:
  struct Threads;
  Pool pool_;
  bool bf16_;
  std::unique_ptr<Threads> threads_;
};

/// Has oneDNN native bfloat16 products on this processor? Its name for the instruction set tells what the bits of a
/// result depend on.
bool has_native_bf16();
const char* instruction_set();

}  // namespace demslam::nn
