#pragma once

#include <algorithm>
#include <map>
#include <string>

#include "demslam/base/error.h"
#include "demslam/base/time.h"
#include "demslam/dataset/bytes.h"

namespace demslam {

/// The records of the ROS 1 bag format 2.0 (the byte `op` of their head).
enum class RecordKind : std::uint8_t {
  message_data = 0x02,
  bag_header = 0x03,
  index_data = 0x04,
  chunk = 0x05,
  chunk_info = 0x06,
  connection = 0x07,
};

/// The head of a record: fields `name=value`, each behind its length.
class RecordFields {
 public:
  RecordFields(std::map<std::string, Bytes> fields, const std::string& source)
      : fields_(std::move(fields)), source_(source) {}

  RecordKind kind() const { return static_cast<RecordKind>(number<std::uint8_t>("op")); }
  std::string text(const std::string& name) const { return ByteReader::to_text(field(name)); }
  template <class Number>
  Number number(const std::string& name) const {
    return ByteReader(field(name), source_).number<Number>();
  }

 private:
  const Bytes& field(const std::string& name) const {
    const auto found = fields_.find(name);
    if (found == fields_.end()) throw Error(source_ + ": a record lacks its field '" + name + "'; the bag is damaged");
    return found->second;
  }

  std::map<std::string, Bytes> fields_;
  std::string source_;
};

inline RecordFields parse_fields(ByteSpan head, const std::string& source) {
  std::map<std::string, Bytes> fields;
  for (ByteReader reader(head, source); !reader.empty();) {
    const ByteSpan field = reader.block();
    const auto equals = std::find(field.begin(), field.end(), '=');
    if (equals == field.end()) throw Error(source + ": a record's field has no '='; the bag is damaged");
    fields[std::string(field.begin(), equals)] = Bytes(equals + 1, field.end());
  }
  return {std::move(fields), source};
}

/// A ROS time: seconds and nanoseconds, 32 bits each.
inline TimestampNs read_ros_time(ByteReader& reader) {
  const TimestampNs seconds = reader.number<std::uint32_t>();
  return seconds * 1'000'000'000 + reader.number<std::uint32_t>();
}

inline void write_ros_time(ByteWriter& writer, TimestampNs t_ns) {
  writer.number(static_cast<std::uint32_t>(t_ns / 1'000'000'000))
      .number(static_cast<std::uint32_t>(t_ns % 1'000'000'000));
}

}  // namespace demslam
