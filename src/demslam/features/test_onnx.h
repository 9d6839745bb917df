#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

namespace demslam::test {

/// Writes ONNX graphs: constants as outputs, which is enough to test contracts without a network, or nodes. Field
/// numbers as in onnx.proto.
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

  /// An attribute of a node.
  using Attribute = std::string;
  static Attribute integer(const std::string& name, std::int64_t value) {
    return field(1, name) + number(3, value) + number(20, 2);
  }
  static Attribute integers(const std::string& name, const std::vector<std::int64_t>& values) {
    std::string message = field(1, name) + number(20, 7);
    for (const std::int64_t value : values) message += number(8, value);
    return message;
  }
  static Attribute real(const std::string& name, float value) {
    return field(1, name) + fixed(2, value) + number(20, 1);
  }
  static Attribute text(const std::string& name, const std::string& value) {
    return field(1, name) + field(4, value) + number(20, 3);
  }
  static Attribute tensor(const std::string& name, const std::vector<std::int64_t>& shape,
                          const std::vector<std::int64_t>& values) {
    return field(1, name) + number(20, 4) +
           field(5, tensor_proto("", kInt64, shape, values.data(), values.size() * sizeof(std::int64_t)));
  }

  void node(const std::string& op, const std::vector<std::string>& inputs, const std::vector<std::string>& outputs,
            const std::vector<Attribute>& attributes = {}) {
    std::string message;
    for (const std::string& name : inputs) message += field(1, name);
    for (const std::string& name : outputs) message += field(2, name);
    message += field(4, op);
    for (const Attribute& attribute : attributes) message += field(5, attribute);
    body_ += field(1, message);
  }
  void constant(const std::string& name, const std::vector<std::int64_t>& shape, const std::vector<float>& values) {
    body_ += field(5, tensor_proto(name, kFloat, shape, values.data(), values.size() * sizeof(float)));
  }
  void constant(const std::string& name, const std::vector<std::int64_t>& shape,
                const std::vector<std::int64_t>& values) {
    body_ += field(5, tensor_proto(name, kInt64, shape, values.data(), values.size() * sizeof(std::int64_t)));
  }
  /// Of sixteen-bit floats, given as their bits.
  void halves(const std::string& name, const std::vector<std::int64_t>& shape,
              const std::vector<std::uint16_t>& values) {
    body_ += field(5, tensor_proto(name, kHalf, shape, values.data(), values.size() * sizeof(std::uint16_t)));
  }
  void float_result(const std::string& name, const std::vector<std::int64_t>& shape) {
    body_ += field(12, value_info(name, kFloat, shape));
  }
  void integer_result(const std::string& name, const std::vector<std::int64_t>& shape) {
    body_ += field(12, value_info(name, kInt64, shape));
  }

  std::string bytes(std::int64_t opset = 17) const {
    return number(1, 8) + field(8, number(2, opset)) + field(7, body_ + field(2, "test"));
  }
  void save(const std::filesystem::path& file) const { std::ofstream(file, std::ios::binary) << bytes(); }

 private:
  static constexpr int kFloat = 1, kInt64 = 7, kHalf = 10;

  static std::string varint(std::uint64_t value) {
    std::string bytes;
    for (; value > 127; value >>= 7) bytes += static_cast<char>(value % 128 + 128);
    return bytes + static_cast<char>(value);
  }
  static std::string number(int tag, std::int64_t value) {
    return varint(tag * 8) + varint(static_cast<std::uint64_t>(value));
  }
  static std::string fixed(int tag, float value) {
    std::string bytes(sizeof value, '\0');
    std::memcpy(bytes.data(), &value, sizeof value);
    return varint(tag * 8 + 5) + bytes;
  }
  static std::string field(int tag, const std::string& bytes) {
    return varint(tag * 8 + 2) + varint(bytes.size()) + bytes;
  }
  static std::string value_info(const std::string& name, int type, const std::vector<std::int64_t>& shape) {
    std::string dims;
    for (const std::int64_t size : shape) dims += field(1, size < 0 ? field(2, "any") : number(1, size));
    return field(1, name) + field(2, field(1, number(1, type) + field(2, dims)));
  }
  static std::string tensor_proto(const std::string& name, int type, const std::vector<std::int64_t>& shape,
                                  const void* data, std::size_t size) {
    std::string dims;
    for (const std::int64_t extent : shape) dims += number(1, extent);
    return dims + number(2, type) + field(8, name) + field(9, std::string(static_cast<const char*>(data), size));
  }
  void add_output(const std::string& name, int type, const std::vector<std::int64_t>& shape, const void* data,
                  std::size_t size) {
    const std::string constant = name + "_constant";
    body_ += field(1, field(1, constant) + field(2, name) + field(4, "Identity"));
    body_ += field(5, tensor_proto(constant, type, shape, data, size));
    body_ += field(12, value_info(name, type, shape));
  }
  std::string body_;
};

}  // namespace demslam::test
