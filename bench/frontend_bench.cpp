// Front-end speed on synthetic square images of a textured plane with sensor noise: extraction of one image, matching
// of a pair, and a whole stereo frame (both images at once on two threads, then the stereo and the temporal matching).
// The CPU column counts all threads of the process, so that a busy machine can still be read.
#include <benchmark/benchmark.h>

#include <filesystem>
#include <future>

#include "demslam/features/frontend.h"
#include "demslam/features/test_images.h"

namespace {

using namespace demslam;

Image view(int size_px, double shift_px) {
  static const test::Texture texture(1);
  Image image = texture.draw(size_px, size_px, -shift_px, 0.0);
  Random random(static_cast<std::uint64_t>(shift_px * 10.0));
  for (std::uint8_t& pixel : image.pixels)
    pixel = static_cast<std::uint8_t>(std::clamp(pixel + 2.0 * random.normal(), 0.0, 255.0));
  return image;
}

enum class Which { classical, lunar, xfeat };

FrontendOptions options_of(Which which) {
  if (which == Which::classical) return {};
  if (which == Which::lunar) return {.extractor = "lunar", .max_features = 1024};
  const std::filesystem::path models = std::filesystem::path(DEMSLAM_SHARED_DIR) / "models";
  return {.extractor = "onnx",
          .matcher = "onnx",
          .extractor_model = models / "xfeat.onnx",
          .matcher_model = models / "lighterglue_l3.onnx",
          .max_features = 1024};
}

/// The front-end, or none with the reason told to the benchmark.
Frontend frontend_or_skip(benchmark::State& state, Which which) {
  const FrontendOptions options = options_of(which);
  if (which != Which::xfeat || std::filesystem::exists(options.extractor_model)) return make_frontend(options);
  state.SkipWithError("no reference models");
  return {};
}

void extract(benchmark::State& state, Which which) {
  const Frontend frontend = frontend_or_skip(state, which);
  if (!frontend.extractor) return;
  const Image image = view(static_cast<int>(state.range(0)), 0.0);
  for (auto _ : state) benchmark::DoNotOptimize(frontend.extractor->extract(image));
}

void match(benchmark::State& state, Which which) {
  const Frontend frontend = frontend_or_skip(state, which);
  if (!frontend.extractor) return;
  const int size_px = static_cast<int>(state.range(0));
  const Features a = frontend.extractor->extract(view(size_px, 0.0)),
                 b = frontend.extractor->extract(view(size_px, 9.5));
  for (auto _ : state) benchmark::DoNotOptimize(frontend.matcher->match(a, b));
}

void stereo_frame(benchmark::State& state, Which which) {
  const Frontend frontend = frontend_or_skip(state, which), other = frontend_or_skip(state, which);
  if (!frontend.extractor) return;
  const int size_px = static_cast<int>(state.range(0));
  const Image left = view(size_px, 3.0), right = view(size_px, 12.5);
  const Features previous = frontend.extractor->extract(view(size_px, 0.0));
  for (auto _ : state) {
    auto pending = std::async(std::launch::async, [&] { return other.extractor->extract(right); });
    const Features a = frontend.extractor->extract(left), b = pending.get();
    benchmark::DoNotOptimize(frontend.matcher->match(a, b));
    benchmark::DoNotOptimize(frontend.matcher->match(a, previous));
  }
}

void both_sizes(benchmark::internal::Benchmark* benchmark) {
  benchmark->Arg(512)->Arg(1024)->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();
}

BENCHMARK_CAPTURE(extract, classical, Which::classical)->Apply(both_sizes);
BENCHMARK_CAPTURE(match, nearest, Which::classical)->Apply(both_sizes);
BENCHMARK_CAPTURE(stereo_frame, classical, Which::classical)->Apply(both_sizes);
BENCHMARK_CAPTURE(extract, lunar, Which::lunar)->Apply(both_sizes);
BENCHMARK_CAPTURE(match, lunar, Which::lunar)->Apply(both_sizes);
BENCHMARK_CAPTURE(stereo_frame, lunar, Which::lunar)->Apply(both_sizes);
BENCHMARK_CAPTURE(extract, xfeat, Which::xfeat)->Apply(both_sizes);
BENCHMARK_CAPTURE(match, lighterglue, Which::xfeat)->Apply(both_sizes);
BENCHMARK_CAPTURE(stereo_frame, xfeat, Which::xfeat)->Apply(both_sizes);

}  // namespace
