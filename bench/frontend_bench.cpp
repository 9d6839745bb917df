// Front-end speed on synthetic square images of a textured plane with sensor noise: extraction of one image, matching
// of a pair, and a whole stereo frame (both images at once on two threads, then the stereo and the temporal matching);
// learned matchers also with a given number of points. Networks by both backends.
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

constexpr const char *kOnnxRuntime = "onnxruntime", *kOneDnn = "onednn";

FrontendOptions options_of(Which which, const char* inference) {
  if (which == Which::classical) return {};
  if (which == Which::lunar)
    return {.extractor = "lunar", .matcher = "lunar", .max_features = 1024, .inference = inference};
  const std::filesystem::path models = std::filesystem::path(DEMSLAM_SHARED_DIR) / "models";
  return {.extractor = "onnx",
          .matcher = "onnx",
          .extractor_model = models / "xfeat.onnx",
          .matcher_model = models / "lighterglue_l3.onnx",
          .max_features = 1024,
          .inference = inference};
}

/// The front-end, or none with the reason told to the benchmark.
Frontend frontend_or_skip(benchmark::State& state, Which which, const char* inference) {
  const FrontendOptions options = options_of(which, inference);
  if (which != Which::xfeat || std::filesystem::exists(options.extractor_model)) return make_frontend(options);
  state.SkipWithError("no reference models");
  return {};
}

void extract(benchmark::State& state, Which which, const char* inference = kOneDnn) {
  const Frontend frontend = frontend_or_skip(state, which, inference);
  if (!frontend.extractor) return;
  const Image image = view(static_cast<int>(state.range(0)), 0.0);
  for (auto _ : state) benchmark::DoNotOptimize(frontend.extractor->extract(image));
}

void match(benchmark::State& state, Which which, const char* inference = kOneDnn) {
  const Frontend frontend = frontend_or_skip(state, which, inference);
  if (!frontend.extractor) return;
  const int size_px = static_cast<int>(state.range(0));
  const Features a = frontend.extractor->extract(view(size_px, 0.0)),
                 b = frontend.extractor->extract(view(size_px, 9.5));
  for (auto _ : state) benchmark::DoNotOptimize(frontend.matcher->match(a, b));
}

/// So many points with descriptors of width 64, and the same points, moved and blurred.
std::pair<Features, Features> random_points(int count) {
  Random random(3);
  Features a{.image_width = 1024, .image_height = 1024}, b = a;
  a.descriptors = b.descriptors = DescriptorRows(count, 64);
  for (int i = 0; i < count; ++i) {
    a.keypoints.emplace_back(random.uniform(0.0, 1000.0), random.uniform(0.0, 1000.0));
    b.keypoints.emplace_back(a.keypoints.back() + Eigen::Vector2f(9.0F, 0.0F));
    for (int k = 0; k < 64; ++k) {
      a.descriptors(i, k) = static_cast<float>(random.normal());
      b.descriptors(i, k) = a.descriptors(i, k) + static_cast<float>(0.2 * random.normal());
    }
  }
  for (Features* features : {&a, &b}) {
    features->scores.assign(static_cast<std::size_t>(count), 1.0F);
    features->descriptors.rowwise().normalize();
  }
  return {a, b};
}

void match_points(benchmark::State& state, Which which, const char* inference) {
  const Frontend frontend = frontend_or_skip(state, which, inference);
  if (!frontend.extractor) return;
  const auto [a, b] = random_points(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(frontend.matcher->match(a, b));
}

void stereo_frame(benchmark::State& state, Which which, const char* inference = kOneDnn) {
  const Frontend frontend = frontend_or_skip(state, which, inference),
                 other = frontend_or_skip(state, which, inference);
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
BENCHMARK_CAPTURE(extract, lunar_onnxruntime, Which::lunar, kOnnxRuntime)->Apply(both_sizes);
BENCHMARK_CAPTURE(extract, lunar_onednn, Which::lunar, kOneDnn)->Apply(both_sizes);
BENCHMARK_CAPTURE(match_points, lunar_onnxruntime, Which::lunar, kOnnxRuntime)->Apply(both_sizes);
BENCHMARK_CAPTURE(match_points, lunar_onednn, Which::lunar, kOneDnn)->Apply(both_sizes);
BENCHMARK_CAPTURE(stereo_frame, lunar_onnxruntime, Which::lunar, kOnnxRuntime)->Apply(both_sizes);
BENCHMARK_CAPTURE(stereo_frame, lunar_onednn, Which::lunar, kOneDnn)->Apply(both_sizes);
BENCHMARK_CAPTURE(extract, xfeat_onnxruntime, Which::xfeat, kOnnxRuntime)->Apply(both_sizes);
BENCHMARK_CAPTURE(extract, xfeat_onednn, Which::xfeat, kOneDnn)->Apply(both_sizes);
BENCHMARK_CAPTURE(match_points, lighterglue_onnxruntime, Which::xfeat, kOnnxRuntime)->Apply(both_sizes);
BENCHMARK_CAPTURE(match_points, lighterglue_onednn, Which::xfeat, kOneDnn)->Apply(both_sizes);
BENCHMARK_CAPTURE(stereo_frame, xfeat_onnxruntime, Which::xfeat, kOnnxRuntime)->Apply(both_sizes);
BENCHMARK_CAPTURE(stereo_frame, xfeat_onednn, Which::xfeat, kOneDnn)->Apply(both_sizes);

}  // namespace
