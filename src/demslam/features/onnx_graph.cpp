#include "demslam/features/onnx_graph.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <set>

#include "demslam/base/error.h"

namespace demslam {
namespace {

/// What is wrong with a file; parse_onnx adds the file's name.
struct Malformed {
  std::string what;
};

enum class Wire { varint = 0, fixed64 = 1, bytes = 2, fixed32 = 5 };

/// One field of a protocol-buffer message: a number or a run of bytes, by its wire type.
struct Field {
  std::uint32_t number = 0;
  Wire wire = Wire::varint;
  std::uint64_t value = 0;
  std::string_view bytes;
};

/// Takes a message apart, one field after the other.
class MessageReader {
 public:
  explicit MessageReader(std::string_view message) : rest_(message) {}

  bool next(Field& field) {
    if (rest_.empty()) return false;
    const std::uint64_t tag = varint();
    field.number = static_cast<std::uint32_t>(tag >> 3U);
    field.wire = static_cast<Wire>(tag & 7U);
    if (tag >> 3U == 0 || tag >> 35U != 0) throw Malformed{"a field without a number"};
    switch (field.wire) {
      case Wire::varint:
        field.value = varint();
        return true;
      case Wire::fixed64:
        field.bytes = take(8);
        return true;
      case Wire::bytes:
        field.bytes = take(varint());
        return true;
      case Wire::fixed32:
        field.bytes = take(4);
        return true;
    }
    throw Malformed{"a field of unknown wire type"};
  }

  bool empty() const { return rest_.empty(); }

  std::uint64_t varint() {
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift < 64; shift += 7) {
      const auto byte = static_cast<std::uint8_t>(take(1)[0]);
      value |= static_cast<std::uint64_t>(byte & 127U) << shift;
      if (byte < 128) return value;
    }
    throw Malformed{"a number of more than 64 bits"};
  }

 private:
  std::string_view take(std::uint64_t count) {
    if (count > rest_.size()) throw Malformed{"it ends too early"};
    const std::string_view taken = rest_.substr(0, count);
    rest_.remove_prefix(count);
    return taken;
  }

  std::string_view rest_;
};

std::string_view bytes_of(const Field& field) {
  if (field.wire != Wire::bytes) throw Malformed{"a number where bytes belong"};
  return field.bytes;
}

std::int64_t integer_of(const Field& field) {
  if (field.wire != Wire::varint) throw Malformed{"bytes where a number belongs"};
  return static_cast<std::int64_t>(field.value);
}

float float_of(const Field& field) {
  if (field.wire != Wire::fixed32) throw Malformed{"something else where a float belongs"};
  float value = 0.0F;
  std::memcpy(&value, field.bytes.data(), sizeof value);
  return value;
}

/// A repeated integer: one by one, or packed.
void append_integers(const Field& field, std::vector<std::int64_t>& values) {
  if (field.wire == Wire::varint) return values.push_back(integer_of(field));
  for (MessageReader packed(bytes_of(field)); !packed.empty();) {
    values.push_back(static_cast<std::int64_t>(packed.varint()));
  }
}

/// Little-endian numbers side by side.
template <class T>
std::vector<T> numbers_in(std::string_view bytes) {
  static_assert(std::endian::native == std::endian::little);
  if (bytes.size() % sizeof(T) != 0) throw Malformed{"a constant that ends within a number"};
  std::vector<T> values(bytes.size() / sizeof(T));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

template <class T>
void append_numbers(const Field& field, std::vector<T>& values) {
  if (field.wire == Wire::varint) throw Malformed{"an integer where floats belong"};
  const std::vector<T> more = numbers_in<T>(field.bytes);
  values.insert(values.end(), more.begin(), more.end());
}

float half_to_float(std::uint16_t half) {
  const std::uint32_t sign = (half & 0x8000U) << 16U, exponent = (half >> 10U) & 31U, fraction = half & 1023U;
  if (exponent == 0) {  // zero or subnormal: exact in a float
    const float value = static_cast<float>(fraction) * 0x1p-24F;
    return sign != 0 ? -value : value;
  }
  const std::uint32_t biased = exponent == 31 ? 255U : exponent + 112U;
  return std::bit_cast<float>(sign | biased << 23U | fraction << 13U);
}

float bfloat_to_float(std::uint16_t bits) { return std::bit_cast<float>(static_cast<std::uint32_t>(bits) << 16U); }

enum DataType { kFloat = 1, kInt32 = 6, kInt64 = 7, kBool = 9, kHalf = 10, kDouble = 11, kBfloat = 16 };

/// TensorProto before its type is known.
struct RawTensor {
  std::string name;
  std::int64_t type = 0;
  bool external = false, has_raw = false;
  std::vector<std::int64_t> shape, integers;
  std::vector<float> floats;
  std::vector<double> doubles;
  std::string_view raw;
};

RawTensor read_raw_tensor(std::string_view message) {
  enum { kDims = 1, kType = 2, kFloats = 4, kInt32s = 5, kInt64s = 7, kName = 8, kRaw = 9, kDoubles = 10, kPlace = 14 };
  RawTensor raw;
  Field field;
  for (MessageReader reader(message); reader.next(field);) {
    if (field.number == kDims) append_integers(field, raw.shape);
    if (field.number == kType) raw.type = integer_of(field);
    if (field.number == kFloats) append_numbers(field, raw.floats);
    if (field.number == kInt32s || field.number == kInt64s) append_integers(field, raw.integers);
    if (field.number == kName) raw.name = bytes_of(field);
    if (field.number == kRaw) raw.raw = bytes_of(field), raw.has_raw = true;
    if (field.number == kDoubles) append_numbers(field, raw.doubles);
    if (field.number == kPlace) raw.external = integer_of(field) != 0;
  }
  return raw;
}

template <class Wanted, class Stored, class Convert>
std::vector<Wanted> converted(const std::vector<Stored>& values, const Convert& convert) {
  std::vector<Wanted> result;
  result.reserve(values.size());
  for (const Stored value : values) result.push_back(static_cast<Wanted>(convert(value)));
  return result;
}

constexpr auto kAsItIs = [](auto value) { return value; };

std::vector<std::uint16_t> sixteen_bits(const RawTensor& raw) {
  return raw.has_raw ? numbers_in<std::uint16_t>(raw.raw) : converted<std::uint16_t>(raw.integers, kAsItIs);
}

void read_floats(const RawTensor& raw, OnnxConstant& constant) {
  constant.kind = OnnxConstant::Kind::floats;
  if (raw.type == kHalf) {
    constant.floats = converted<float>(sixteen_bits(raw), half_to_float);
  } else if (raw.type == kBfloat) {
    constant.floats = converted<float>(sixteen_bits(raw), bfloat_to_float);
  } else if (raw.type == kDouble) {
    constant.floats = converted<float>(raw.has_raw ? numbers_in<double>(raw.raw) : raw.doubles, kAsItIs);
  } else {
    constant.floats = raw.has_raw ? numbers_in<float>(raw.raw) : raw.floats;
  }
}

void read_integers(const RawTensor& raw, OnnxConstant& constant) {
  constant.kind = raw.type == kBool ? OnnxConstant::Kind::booleans : OnnxConstant::Kind::integers;
  constant.integers = raw.integers;
  if (!raw.has_raw) return;
  if (raw.type == kInt64) constant.integers = numbers_in<std::int64_t>(raw.raw);
  if (raw.type == kInt32) constant.integers = converted<std::int64_t>(numbers_in<std::int32_t>(raw.raw), kAsItIs);
  if (raw.type == kBool) constant.integers = converted<std::int64_t>(numbers_in<std::uint8_t>(raw.raw), kAsItIs);
}

/// Values that the shape asks for; an error when that overflows, or is below zero somewhere.
std::size_t wanted_count(const std::vector<std::int64_t>& shape) {
  std::size_t count = 1;
  for (const std::int64_t size : shape) {
    if (size < 0 || __builtin_mul_overflow(count, static_cast<std::size_t>(size), &count)) {
      throw Malformed{"a constant of impossible shape"};
    }
  }
  return count;
}

OnnxConstant read_constant(const RawTensor& raw) {
  OnnxConstant constant{.shape = raw.shape};
  const bool is_float = raw.type == kFloat || raw.type == kHalf || raw.type == kBfloat || raw.type == kDouble;
  const bool is_integer = raw.type == kInt64 || raw.type == kInt32 || raw.type == kBool;
  if (raw.external || !(is_float || is_integer)) return constant;
  is_float ? read_floats(raw, constant) : read_integers(raw, constant);
  const std::size_t have = is_float ? constant.floats.size() : constant.integers.size();
  if (have != wanted_count(constant.shape)) throw Malformed{"constant '" + raw.name + "' does not fill its shape"};
  return constant;
}

std::pair<std::string, OnnxAttribute> read_attribute(std::string_view message) {
  enum { kName = 1, kF = 2, kI = 3, kS = 4, kT = 5, kFs = 7, kIs = 8, kType = 20 };
  enum { kTypeF = 1, kTypeI = 2, kTypeS = 3, kTypeT = 4, kTypeFs = 6, kTypeIs = 7 };
  std::string name;
  std::int64_t type = 0, integer = 0;
  float number = 0.0F;
  std::string_view text, tensor;
  std::vector<std::int64_t> integers;
  std::vector<float> floats;
  Field field;
  for (MessageReader reader(message); reader.next(field);) {
    if (field.number == kName) name = bytes_of(field);
    if (field.number == kF) number = float_of(field);
    if (field.number == kI) integer = integer_of(field);
    if (field.number == kS) text = bytes_of(field);
    if (field.number == kT) tensor = bytes_of(field);
    if (field.number == kFs) append_numbers(field, floats);
    if (field.number == kIs) append_integers(field, integers);
    if (field.number == kType) type = integer_of(field);
  }
  if (type == kTypeF) return {name, number};
  if (type == kTypeI) return {name, integer};
  if (type == kTypeS) return {name, std::string(text)};
  if (type == kTypeT) return {name, read_constant(read_raw_tensor(tensor))};
  if (type == kTypeFs) return {name, floats};
  if (type == kTypeIs) return {name, integers};
  return {name, std::monostate()};
}

OnnxNode read_node(std::string_view message) {
  enum { kInput = 1, kOutput = 2, kOp = 4, kAttribute = 5, kDomain = 7 };
  OnnxNode node;
  Field field;
  for (MessageReader reader(message); reader.next(field);) {
    if (field.number == kInput) node.inputs.emplace_back(bytes_of(field));
    if (field.number == kOutput) node.outputs.emplace_back(bytes_of(field));
    if (field.number == kOp) node.op = bytes_of(field);
    if (field.number == kDomain) node.domain = bytes_of(field);
    if (field.number == kAttribute) node.attributes.insert(read_attribute(bytes_of(field)));
  }
  if (node.domain == "ai.onnx") node.domain.clear();
  return node;
}

/// TensorShapeProto; a size that is a name or left out is any size.
std::vector<std::int64_t> read_shape(std::string_view message) {
  std::vector<std::int64_t> shape;
  Field dim, field;
  for (MessageReader reader(message); reader.next(dim);) {
    if (dim.number != 1) continue;
    shape.push_back(-1);
    for (MessageReader size(bytes_of(dim)); size.next(field);) {
      if (field.number == 1) shape.back() = integer_of(field);
    }
  }
  return shape;
}

/// ValueInfoProto: name and TypeProto, of which tensors are described.
TensorInfo read_value_info(std::string_view message) {
  TensorInfo info{.type = "other"};
  Field field, kind, part;
  for (MessageReader reader(message); reader.next(field);) {
    if (field.number == 1) info.name = bytes_of(field);
    if (field.number != 2) continue;
    for (MessageReader type(bytes_of(field)); type.next(kind);) {
      if (kind.number != 1) continue;  // no tensor
      for (MessageReader tensor(bytes_of(kind)); tensor.next(part);) {
        if (part.number == 1 && integer_of(part) == kFloat) info.type = "float32";
        if (part.number == 1 && integer_of(part) == kInt64) info.type = "int64";
        if (part.number == 2) info.shape = read_shape(bytes_of(part));
      }
    }
  }
  return info;
}

void read_graph(std::string_view message, OnnxGraph& graph) {
  enum { kNode = 1, kInitializer = 5, kInput = 11, kOutput = 12 };
  Field field;
  for (MessageReader reader(message); reader.next(field);) {
    if (field.number == kNode) graph.nodes.push_back(read_node(bytes_of(field)));
    if (field.number == kInput) graph.inputs.push_back(read_value_info(bytes_of(field)));
    if (field.number == kOutput) graph.outputs.push_back(read_value_info(bytes_of(field)));
    if (field.number != kInitializer) continue;
    const RawTensor raw = read_raw_tensor(bytes_of(field));
    graph.constants.insert_or_assign(raw.name, read_constant(raw));
  }
  std::erase_if(graph.inputs, [&](const TensorInfo& input) { return graph.constants.contains(input.name); });
}

void read_opset(std::string_view message, OnnxGraph& graph) {
  std::string domain;
  std::int64_t version = 0;
  Field field;
  for (MessageReader reader(message); reader.next(field);) {
    if (field.number == 1) domain = bytes_of(field);
    if (field.number == 2) version = integer_of(field);
  }
  if (domain.empty() || domain == "ai.onnx") graph.opset = version;
}

/// Every value is made once, before it is used.
void check_order(const OnnxGraph& graph) {
  std::set<std::string, std::less<>> known{""};
  for (const auto& [name, constant] : graph.constants) known.insert(name);
  for (const TensorInfo& input : graph.inputs) known.insert(input.name);
  for (const OnnxNode& node : graph.nodes) {
    for (const std::string& name : node.inputs) {
      if (!known.contains(name)) throw Malformed{"'" + name + "' is used before it is made"};
    }
    for (const std::string& name : node.outputs) {
      if (!known.insert(name).second && !name.empty()) throw Malformed{"'" + name + "' is made twice"};
    }
  }
  for (const TensorInfo& output : graph.outputs) {
    if (!known.contains(output.name)) throw Malformed{"output '" + output.name + "' is never made"};
  }
}

OnnxGraph read_model(std::string_view bytes) {
  enum { kOpset = 8, kGraph = 7 };
  OnnxGraph graph;
  bool found = false;
  Field field;
  for (MessageReader reader(bytes); reader.next(field);) {
    if (field.number == kOpset) read_opset(bytes_of(field), graph);
    if (field.number == kGraph) read_graph(bytes_of(field), graph), found = true;
  }
  if (!found || graph.outputs.empty()) throw Malformed{"it has no graph"};
  check_order(graph);
  return graph;
}

}  // namespace

OnnxGraph parse_onnx(std::string_view bytes, const std::string& name) {
  try {
    return read_model(bytes);
  } catch (const Malformed& malformed) {
    throw Error(name + ": not a usable ONNX model, or truncated (" + malformed.what + ")");
  }
}

}  // namespace demslam
