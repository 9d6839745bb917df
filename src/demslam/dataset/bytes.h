#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "demslam/base/error.h"

namespace demslam {

static_assert(std::endian::native == std::endian::little, "ROS bags are little-endian and read in place");

using Bytes = std::vector<std::uint8_t>;
using ByteSpan = std::span<const std::uint8_t>;

/// Reads little-endian values off a span, front to back. Throws Error where the span ends too early.
class ByteReader {
 public:
  /// `source` names what is read, for the message; it must outlive the reader.
  ByteReader(ByteSpan bytes, const std::string& source) : rest_(bytes), source_(source) {}

  bool empty() const { return rest_.empty(); }

  ByteSpan take(std::size_t count) {
    if (count > rest_.size()) throw Error(source_ + ": ends in the middle of a record; the file is damaged");
    const ByteSpan taken = rest_.first(count);
    rest_ = rest_.subspan(count);
    return taken;
  }
  template <class Number>
  Number number() {
    Number value;
    std::memcpy(&value, take(sizeof value).data(), sizeof value);
    return value;
  }
  /// Bytes behind their own 32-bit length.
  ByteSpan block() { return take(number<std::uint32_t>()); }
  std::string text() { return to_text(block()); }

  static std::string to_text(ByteSpan bytes) { return {bytes.begin(), bytes.end()}; }

 private:
  ByteSpan rest_;
  const std::string& source_;
};

/// Appends little-endian values to a buffer.
class ByteWriter {
 public:
  template <class Number>
  ByteWriter& number(Number value) {
    const auto* begin = reinterpret_cast<const std::uint8_t*>(&value);
    bytes_.insert(bytes_.end(), begin, begin + sizeof value);
    return *this;
  }
  ByteWriter& raw(ByteSpan bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return *this;
  }
  ByteWriter& block(ByteSpan bytes) { return number(static_cast<std::uint32_t>(bytes.size())).raw(bytes); }
  ByteWriter& text(const std::string& text) { return block(as_bytes(text)); }

  static ByteSpan as_bytes(const std::string& text) {
    return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
  }
  const Bytes& bytes() const { return bytes_; }
  std::size_t size() const { return bytes_.size(); }
  void clear() { bytes_.clear(); }

 private:
  Bytes bytes_;
};

}  // namespace demslam
