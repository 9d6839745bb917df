#pragma once

#include <bit>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "demslam/base/error.h"

namespace demslam {

static_assert(std::endian::native == std::endian::little, "archives are little-endian");

// State as bytes, exactly: what is read has the bits of what was written. A structure names its fields once, for
// writing and for reading:
//   template <class Archive> void archive(Archive& io, Landmark& l) { io(l.pixel, l.disparity_px); }

class ArchiveWriter {
 public:
  template <class... T>
  void operator()(const T&... values) {
    (put(values), ...);
  }
  std::string take() { return std::move(bytes_); }

 private:
  template <class T>
  void put(const T& value) {
    if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>) {
      bytes_.append(reinterpret_cast<const char*>(&value), sizeof(T));
    } else {
      archive(*this, const_cast<T&>(value));  // which only reads it
    }
  }
  void put(const std::string& text) {
    put(std::uint64_t(text.size()));
    bytes_ += text;
  }
  template <class T>
  void put(const std::vector<T>& values) {
    put_all(values);
  }
  template <class T>
  void put(const std::deque<T>& values) {
    put_all(values);
  }
  template <class T>
  void put(const std::optional<T>& value) {
    put(value.has_value());
    if (value) put(*value);
  }
  template <class Container>
  void put_all(const Container& values) {
    put(std::uint64_t(values.size()));
    for (const auto& value : values) put(value);
  }

  std::string bytes_;
};

/// Throws Error where the bytes end too early or claim what cannot be.
class ArchiveReader {
 public:
  /// `bytes` must outlive the reader.
  explicit ArchiveReader(std::string_view bytes) : rest_(bytes) {}

  template <class... T>
  void operator()(T&... values) {
    (get(values), ...);
  }
  bool empty() const { return rest_.empty(); }

 private:
  std::string_view take(std::uint64_t count) {
    if (count > rest_.size()) throw Error("a stored state ends too early: the map is damaged");
    const std::string_view taken = rest_.substr(0, count);
    rest_.remove_prefix(count);
    return taken;
  }
  template <class T>
  void get(T& value) {
    if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>) {
      take(sizeof(T)).copy(reinterpret_cast<char*>(&value), sizeof(T));
    } else {
      archive(*this, value);
    }
  }
  void get(std::string& text) { text = take(count()); }
  template <class T>
  void get(std::vector<T>& values) {
    get_all(values);
  }
  template <class T>
  void get(std::deque<T>& values) {
    get_all(values);
  }
  template <class T>
  void get(std::optional<T>& value) {
    bool there = false;
    get(there);
    if (there) get(value.emplace());
    if (!there) value.reset();
  }
  template <class Container>
  void get_all(Container& values) {
    values.clear();
    for (std::uint64_t left = count(); left > 0; --left) get(values.emplace_back());
  }
  /// No element is smaller than a byte, so that a damaged count is found out before memory is taken for it.
  std::uint64_t count() {
    std::uint64_t count = 0;
    get(count);
    if (count > rest_.size()) throw Error("a stored state ends too early: the map is damaged");
    return count;
  }

  std::string_view rest_;
};

}  // namespace demslam
