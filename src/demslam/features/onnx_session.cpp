#include "demslam/features/onnx_session.h"

#include <onnxruntime_cxx_api.h>
#include <onnxruntime_session_options_config_keys.h>

#include <algorithm>
#include <iostream>

#include "demslam/base/error.h"

namespace demslam {
namespace {

/// Swallows what is written to std::cerr while it lives. Debian's ONNX Runtime reports over a thousand duplicate
/// operator schemas there when the first session opens, and no logging level stops it.
class SilentCerr {
 public:
  SilentCerr() : previous_(std::cerr.rdbuf(nullptr)) {}
  ~SilentCerr() {
    std::cerr.rdbuf(previous_);  // also clears the error state that the missing buffer caused
  }
  SilentCerr(const SilentCerr&) = delete;

 private:
  std::streambuf* previous_;
};

Ort::Env& environment() {
  static Ort::Env instance(ORT_LOGGING_LEVEL_FATAL, "demslam");
  return instance;
}

Ort::SessionOptions options_for(int threads) {
  Ort::SessionOptions options;
  options.SetIntraOpNumThreads(std::max(threads, 1));
  options.SetInterOpNumThreads(1);
  options.SetGraphOptimizationLevel(GraphOptimizationLevel::ORT_ENABLE_ALL);
  options.SetDeterministicCompute(true);
  options.AddConfigEntry(kOrtSessionOptionsConfigAllowIntraOpSpinning, "0");
  return options;
}

std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

/// `make` opens the session; what it says of a bad graph becomes an Error.
template <class Make>
Ort::Session open(const std::string& name, const Make& make) {
  const SilentCerr silence;
  try {
    return make();
  } catch (const Ort::Exception& error) {
    throw Error(name + ": not a usable ONNX model, or truncated (" + first_line(error.what()) + ")");
  }
}

Ort::Session open_file(const std::filesystem::path& file, int threads) {
  if (!std::filesystem::is_regular_file(file)) throw Error(file.string() + ": no such model file");
  return open(file.string(), [&] { return Ort::Session(environment(), file.c_str(), options_for(threads)); });
}

Ort::Session open_bytes(std::string_view graph, const std::string& name, int threads) {
  return open(name, [&] { return Ort::Session(environment(), graph.data(), graph.size(), options_for(threads)); });
}

TensorInfo describe(const std::string& name, const Ort::TypeInfo& type) {
  TensorInfo info{name, "other", {}};
  if (type.GetONNXType() != ONNX_TYPE_TENSOR) return info;
  const auto tensor = type.GetTensorTypeAndShapeInfo();
  if (tensor.GetElementType() == ONNX_TENSOR_ELEMENT_DATA_TYPE_FLOAT) info.type = "float32";
  if (tensor.GetElementType() == ONNX_TENSOR_ELEMENT_DATA_TYPE_INT64) info.type = "int64";
  info.shape = tensor.GetShape();
  return info;
}

std::vector<const char*> c_strings(const std::vector<std::string>& texts) {
  std::vector<const char*> pointers;
  for (const std::string& text : texts) pointers.push_back(text.c_str());
  return pointers;
}

Tensor to_tensor(const Ort::Value& value) {
  const auto info = value.GetTensorTypeAndShapeInfo();
  Tensor tensor{.shape = info.GetShape()};
  if (info.GetElementType() == ONNX_TENSOR_ELEMENT_DATA_TYPE_INT64) {
    tensor.integers.assign(value.GetTensorData<std::int64_t>(),
                           value.GetTensorData<std::int64_t>() + info.GetElementCount());
  } else {
    tensor.floats.assign(value.GetTensorData<float>(), value.GetTensorData<float>() + info.GetElementCount());
  }
  return tensor;
}

}  // namespace

struct OnnxSession::Runtime {
  std::string file;
  Ort::Session session;
  Ort::MemoryInfo memory = Ort::MemoryInfo::CreateCpu(OrtArenaAllocator, OrtMemTypeDefault);
};

OnnxSession::OnnxSession(const std::filesystem::path& file, int threads)
    : runtime_(std::make_unique<Runtime>(file.string(), open_file(file, threads))) {}
OnnxSession::OnnxSession(std::string_view graph, const std::string& name, int threads)
    : runtime_(std::make_unique<Runtime>(name, open_bytes(graph, name, threads))) {}
OnnxSession::~OnnxSession() = default;
OnnxSession::OnnxSession(OnnxSession&&) noexcept = default;

std::vector<TensorInfo> OnnxSession::inputs() const {
  const Ort::AllocatorWithDefaultOptions allocator;
  std::vector<TensorInfo> infos;
  for (std::size_t i = 0; i < runtime_->session.GetInputCount(); ++i) {
    infos.push_back(
        describe(runtime_->session.GetInputNameAllocated(i, allocator).get(), runtime_->session.GetInputTypeInfo(i)));
  }
  return infos;
}

std::vector<TensorInfo> OnnxSession::outputs() const {
  const Ort::AllocatorWithDefaultOptions allocator;
  std::vector<TensorInfo> infos;
  for (std::size_t i = 0; i < runtime_->session.GetOutputCount(); ++i) {
    infos.push_back(
        describe(runtime_->session.GetOutputNameAllocated(i, allocator).get(), runtime_->session.GetOutputTypeInfo(i)));
  }
  return infos;
}

std::vector<Tensor> OnnxSession::run(const std::vector<std::string>& input_names, std::vector<Tensor> inputs,
                                     const std::vector<std::string>& output_names) {
  std::vector<Ort::Value> values;
  for (Tensor& input : inputs) {
    values.push_back(Ort::Value::CreateTensor<float>(runtime_->memory, input.floats.data(), input.floats.size(),
                                                     input.shape.data(), input.shape.size()));
  }
  try {
    const auto results = runtime_->session.Run(Ort::RunOptions{nullptr}, c_strings(input_names).data(), values.data(),
                                               values.size(), c_strings(output_names).data(), output_names.size());
    std::vector<Tensor> tensors;
    for (const Ort::Value& result : results) tensors.push_back(to_tensor(result));
    return tensors;
  } catch (const Ort::Exception& error) {
    throw Error(runtime_->file + ": the model failed while running (" + first_line(error.what()) + ")");
  }
}

}  // namespace demslam
