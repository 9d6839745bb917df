#include "demslam/features/network_engine.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <dnnl.hpp>

#include <algorithm>

// OpenMP's own, which is oneDNN's threading; not every compiler brings its header.
extern "C" int omp_get_max_threads();
extern "C" void omp_set_num_threads(int count);

namespace demslam::nn {

OneOpenMpThread::OneOpenMpThread() : before_(omp_get_max_threads()) { omp_set_num_threads(1); }
OneOpenMpThread::~OneOpenMpThread() { omp_set_num_threads(before_); }

struct Engine::Threads {
  explicit Threads(int count) : arena(count) {}
  tbb::task_arena arena;
};

Engine::Engine(int threads, bool bf16) : bf16_(bf16), threads_(std::make_unique<Threads>(std::max(threads, 1))) {}
Engine::~Engine() = default;

void Engine::parallel(std::int64_t count, const std::function<void(std::int64_t)>& work) {
  if (count == 1) return work(0);
  threads_->arena.execute([&] {
    tbb::parallel_for(std::int64_t{0}, count, [&](std::int64_t i) {
      const OneOpenMpThread one;
      work(i);
    });
  });
}

bool has_native_bf16() {
  constexpr auto kNeeded = static_cast<unsigned>(dnnl::cpu_isa::avx512_core_bf16);
  return (static_cast<unsigned>(dnnl::get_effective_cpu_isa()) & kNeeded) == kNeeded;
}

const char* instruction_set() {
  switch (dnnl::get_effective_cpu_isa()) {
    case dnnl::cpu_isa::avx10_1_512_amx_fp16:
      return "amx_fp16";
    case dnnl::cpu_isa::avx10_1_512_amx:
      return "amx";
    case dnnl::cpu_isa::avx10_1_512:
      return "avx512_fp16";
    case dnnl::cpu_isa::avx512_core_bf16:
      return "avx512_bf16";
    case dnnl::cpu_isa::avx512_core_vnni:
    case dnnl::cpu_isa::avx512_core:
      return "avx512";
    case dnnl::cpu_isa::avx2_vnni_2:
    case dnnl::cpu_isa::avx2_vnni:
    case dnnl::cpu_isa::avx2:
      return "avx2";
    default:
      return "sse";
  }
}

}  // namespace demslam::nn
