#include "demslam/image/gif.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "demslam/base/error.h"

namespace demslam {
namespace {

using Bytes = std::vector<std::uint8_t>;

void append(Bytes& bytes, std::string_view text) { bytes.insert(bytes.end(), text.begin(), text.end()); }

void append16(Bytes& bytes, int value) {
  bytes.push_back(static_cast<std::uint8_t>(value & 0xff));
  bytes.push_back(static_cast<std::uint8_t>(value >> 8));
}

/// Codes of growing width, least significant bit first.
class BitStream {
 public:
  void put(unsigned code, int width) {
    pending_ |= code << count_;
    for (count_ += width; count_ >= 8; count_ -= 8, pending_ >>= 8) bytes_.push_back(pending_ & 0xff);
  }
  Bytes finish() {
    if (count_ > 0) bytes_.push_back(pending_ & 0xff);
    return std::move(bytes_);
  }

 private:
  Bytes bytes_;
  std::uint32_t pending_ = 0;
  int count_ = 0;
};

constexpr unsigned kColours = 256, kClear = 256, kEnd = 257, kFirstFree = 258, kFull = 4096;

/// Lempel-Ziv-Welch as GIF has it: 9 to 12 bits, the dictionary thrown away when it is full.
Bytes lzw(const Bytes& pixels) {
  std::vector<std::uint16_t> next(std::size_t{kFull} * kColours, 0);  // code of (prefix, pixel); 0: none
  BitStream stream;
  unsigned free = kFirstFree, prefix = pixels.front();
  int width = 9;
  stream.put(kClear, width);
  for (std::size_t i = 1; i < pixels.size(); ++i) {
    std::uint16_t& code = next[prefix * kColours + pixels[i]];
    if (code != 0) {
      prefix = code;
      continue;
    }
    stream.put(prefix, width);
    prefix = pixels[i];
    if (free == kFull) {
      stream.put(kClear, width);
      std::fill(next.begin(), next.end(), std::uint16_t{0});
      free = kFirstFree;
      width = 9;
      continue;
    }
    code = static_cast<std::uint16_t>(free);
    if (free++ == 1U << width) ++width;
  }
  stream.put(prefix, width);
  if (free == 1U << width && width < 12) ++width;  // a reader has one word more by now
  stream.put(kEnd, width);
  return stream.finish();
}

void append_frame(Bytes& bytes, const Image& image, int hundredths) {
  append(bytes, std::string_view("\x21\xf9\x04\x04", 4));  // graphic control: leave in place
  append16(bytes, hundredths);
  append16(bytes, 0);
  bytes.push_back(0x2c);
  for (const int value : {0, 0, image.width, image.height}) append16(bytes, value);
  bytes.push_back(0);
  bytes.push_back(8);  // bits of the smallest code
  const Bytes data = lzw(image.pixels);
  for (std::size_t first = 0; first < data.size(); first += 255) {
    const std::size_t count = std::min<std::size_t>(255, data.size() - first);
    bytes.push_back(static_cast<std::uint8_t>(count));
    bytes.insert(bytes.end(), data.begin() + static_cast<std::ptrdiff_t>(first),
                 data.begin() + static_cast<std::ptrdiff_t>(first + count));
  }
  bytes.push_back(0);
}

}  // namespace

std::vector<std::uint8_t> gif_bytes(std::span<const Image> frames, double frame_s) {
  if (frames.empty() || frames.front().empty()) throw Error("a GIF needs at least one picture");
  Bytes bytes;
  append(bytes, "GIF89a");
  append16(bytes, frames.front().width);
  append16(bytes, frames.front().height);
  append(bytes, std::string_view("\xf7\0\0", 3));  // a palette of 256
  for (unsigned grey = 0; grey < kColours; ++grey) bytes.insert(bytes.end(), 3, static_cast<std::uint8_t>(grey));
  append(bytes, std::string_view("\x21\xff\x0bNETSCAPE2.0\x03\x01\0\0\0", 19));  // for ever
  for (const Image& frame : frames) {
    if (frame.width != frames.front().width || frame.height != frames.front().height) {
      throw Error("the pictures of a GIF must have one size");
    }
    append_frame(bytes, frame, static_cast<int>(std::lround(100.0 * frame_s)));
  }
  bytes.push_back(0x3b);
  return bytes;
}

}  // namespace demslam
