#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace demslam::test {

/// Writes ONNX graphs whose outputs are constants: enough to test contracts without a network. Field numbers as in
/// onnx.proto.
class OnnxGraph {
 public:
  void input(const std::string& name, const std::vector<std::int64_t>& shape) {
    body_ += field(11, value_info(name, kFloat, shape));
  }
  void output(const std::string& name, const std::vector<std::int64_t>& shape, const std::vector<float>& values) {
    add_output(name, kFloat, shape, values.data(), values.size() * sizeof(float));
  }
  void output(const std::string& name, const std::vector<std::int64_t>& shape,
              const std::vector<std::int64_t>& values) {
    add_output(name, kInt64, shape, values.data(), values.size() * sizeof(std::int64_t));
  }
  void save(const std::filesystem::path& file) const {
    const std::string model = number(1, 8) + field(8, number(2, 17)) + field(7, body_ + field(2, "test"));
    std::ofstream(file, std::ios::binary) << model;
  }

 private:
  static constexpr int kFloat = 1, kInt64 = 7;

  static std::string varint(std::uint64_t value) {
    std::string bytes;
    for (; value > 127; value >>= 7) bytes += static_cast<char>(value % 128 + 128);
    return bytes + static_cast<char>(value);
  }
  static std::string number(int tag, std::int64_t value) {
    return varint(tag * 8) + varint(static_cast<std::uint64_t>(value));
  }
  static std::string field(int tag, const std::string& bytes) {
    return varint(tag * 8 + 2) + varint(bytes.size()) + bytes;
  }
  static std::string value_info(const std::string& name, int type, const std::vector<std::int64_t>& shape) {
    std::string dims;
    for (const std::int64_t size : shape) dims += field(1, size < 0 ? field(2, "any") : number(1, size));
    return field(1, name) + field(2, field(1, number(1, type) + field(2, dims)));
  }
  void add_output(const std::string& name, int type, const std::vector<std::int64_t>& shape, const void* data,
                  std::size_t size) {
    std::string dims;
    for (const std::int64_t extent : shape) dims += number(1, extent);
    const std::string constant = name + "_constant", raw(static_cast<const char*>(data), size);
    body_ += field(1, field(1, constant) + field(2, name) + field(4, "Identity"));
    body_ += field(5, dims + number(2, type) + field(8, constant) + field(9, raw));
    body_ += field(12, value_info(name, type, shape));
  }
  std::string body_;
};

}  // namespace demslam::test
