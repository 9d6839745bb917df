#include "demslam/image/encoded.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>

#include "demslam/base/error.h"

namespace demslam {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::array<std::uint8_t, 8> kPngSignature = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
constexpr std::array<std::uint8_t, 3> kJpegSignature = {0xff, 0xd8, 0xff};
constexpr std::array<std::uint8_t, 4> kPngEnd = {'I', 'E', 'N', 'D'};

template <std::size_t N>
bool starts_with(Bytes bytes, const std::array<std::uint8_t, N>& signature) {
  return bytes.size() >= N && std::equal(signature.begin(), signature.end(), bytes.begin());
}

std::size_t big_endian_u32(Bytes bytes) {
  return (std::size_t{bytes[0]} << 24) | (std::size_t{bytes[1]} << 16) | (std::size_t{bytes[2]} << 8) | bytes[3];
}

/// Walks the chunks (length, type, data, checksum) up to IEND.
bool png_is_complete(Bytes bytes) {
  std::size_t at = kPngSignature.size();
  while (at + 12 <= bytes.size()) {
    const std::size_t end = at + 12 + big_endian_u32(bytes.subspan(at));
    if (end > bytes.size()) return false;
    if (starts_with(bytes.subspan(at + 4), kPngEnd)) return true;
    at = end;
  }
  return false;
}

/// An end-of-image marker, after which only zero padding may follow.
bool jpeg_is_complete(Bytes bytes) {
  std::size_t size = bytes.size();
  while (size > 0 && bytes[size - 1] == 0) --size;
  return size >= 2 && bytes[size - 2] == 0xff && bytes[size - 1] == 0xd9;
}

}  // namespace

std::vector<std::uint8_t> read_encoded(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) throw Error("image " + file.string() + " does not exist");
  if (!std::filesystem::is_regular_file(file)) throw Error("image " + file.string() + " is not a file");
  std::ifstream stream(file, std::ios::binary);
  std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (!stream) throw Error("image " + file.string() + " cannot be read; check its permissions");
  if (bytes.empty()) throw Error("image " + file.string() + " is empty");
  return bytes;
}

void check_complete(std::span<const std::uint8_t> bytes, const std::filesystem::path& file) {
  const bool truncated = (starts_with(bytes, kPngSignature) && !png_is_complete(bytes)) ||
                         (starts_with(bytes, kJpegSignature) && !jpeg_is_complete(bytes));
  if (truncated) throw Error("image " + file.string() + " is truncated; copy it again");
}

void write_encoded(const std::filesystem::path& file, std::span<const std::uint8_t> bytes) {
  std::ofstream stream(file, std::ios::binary | std::ios::trunc);
  if (!stream) throw Error("cannot create " + file.string() + "; check that its folder exists and is writable");
  stream.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  stream.close();
  if (!stream) {
    std::error_code ignored;
    std::filesystem::remove(file, ignored);
    throw Error("cannot write " + file.string() + "; is the disk full?");
  }
}

}  // namespace demslam
