#include <bit>
#include <cstdint>

#include "demslam/report/internal/packed.h"

namespace demslam {
namespace {

static_assert(std::endian::native == std::endian::little, "the page reads little-endian arrays");

template <class T>
std::string base64_of(std::span<const T> values) {
  return base64({reinterpret_cast<const char*>(values.data()), values.size_bytes()});
}

}  // namespace

std::string base64(std::string_view bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k) word = word << 8 | (k < left ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += k <= left ? kDigits[word >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

nlohmann::ordered_json packed(std::span<const float> values) { return {{"f32", base64_of(values)}}; }

nlohmann::ordered_json packed(std::span<const std::uint16_t> values) { return {{"u16", base64_of(values)}}; }

nlohmann::ordered_json packed(const Columns& columns) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const Column& column : columns) json[column.name] = packed(std::span<const float>(column.values));
  return json;
}

}  // namespace demslam
