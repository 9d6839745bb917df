// The map on disk: time to append a keyframe of 1500 features, to read its features back, and its size on disk.
// Argument: descriptor width / 0 exact, 1 bytes.
#include <benchmark/benchmark.h>

#include <filesystem>

#include "demslam/store/map_store.h"
#include "demslam/store/test_map.h"

namespace {

using namespace demslam;
namespace fs = std::filesystem;

constexpr std::size_t kFeatures = 1500;

MapStoreOptions options(const benchmark::State& state) {
  return {state.range(1) == 0 ? DescriptorCoding::exact : DescriptorCoding::bytes};
}

/// A map in the working folder, removed at the end: a temporary folder may be memory.
struct ScratchMap {
  fs::path file = "store_bench.db";
  ScratchMap() { fs::remove(file); }
  ~ScratchMap() { fs::remove(file); }
};

void append_keyframe(benchmark::State& state) {
  const ScratchMap scratch;
  const auto features = test::random_features(1, kFeatures, static_cast<int>(state.range(0)));
  std::size_t index = 0;
  {
    MapStore store = MapStore::create(scratch.file, test::small_header(), options(state));
    for (auto _ : state) {
      state.PauseTiming();
      KeyframeEntry entry = test::entry(index++, 0);
      entry.features = features;
      state.ResumeTiming();
      store.append(entry);
    }
  }
  state.counters["KB_per_keyframe"] =
      1e-3 * static_cast<double>(fs::file_size(scratch.file)) / static_cast<double>(index);
}
BENCHMARK(append_keyframe)
    ->ArgsProduct({{64, 128, 256}, {0, 1}})
    ->Iterations(1000)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

void read_features(benchmark::State& state) {
  const ScratchMap scratch;
  MapStore store = MapStore::create(scratch.file, test::small_header(), options(state));
  constexpr std::size_t kKeyframes = 100;
  for (std::size_t k = 0; k < kKeyframes; ++k)
    store.append(test::entry(k, kFeatures, static_cast<int>(state.range(0))));
  std::size_t next = 0;
  for (auto _ : state) benchmark::DoNotOptimize(store.features(next++ * 37 % kKeyframes));
}
BENCHMARK(read_features)->ArgsProduct({{64, 128, 256}, {0, 1}})->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
