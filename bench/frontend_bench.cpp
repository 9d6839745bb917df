// Front-end speed on a synthetic stereo pair: extraction of one image, one matching, and the whole of a stereo frame.
#include <benchmark/benchmark.h>

#include <future>

#include "demslam/features/frontend.h"
#include "demslam/features/test_images.h"

namespace {

using namespace demslam;

const test::Texture& texture() {
  static const test::Texture instance(1);
  return instance;
}

void extract_classical(benchmark::State& state) {
  const int size = static_cast<int>(state.range(0));
  const Image image = texture().draw(size, size);
  Frontend frontend = make_frontend({});
  for (auto _ : state) benchmark::DoNotOptimize(frontend.extractor->extract(image));
}
BENCHMARK(extract_classical)->Arg(512)->Arg(1024)->Unit(benchmark::kMillisecond);

void match_nearest(benchmark::State& state) {
  const int size = static_cast<int>(state.range(0));
  Frontend frontend = make_frontend({});
  const Features a = frontend.extractor->extract(texture().draw(size, size));
  const Features b = frontend.extractor->extract(texture().draw(size, size, -9.5, 0.0));
  for (auto _ : state) benchmark::DoNotOptimize(frontend.matcher->match(a, b));
}
BENCHMARK(match_nearest)->Arg(512)->Arg(1024)->Unit(benchmark::kMillisecond);

}  // namespace
