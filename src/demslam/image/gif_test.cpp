#include "demslam/image/gif.h"

#include <gtest/gtest.h>

#include <string>

#include "demslam/base/error.h"
#include "demslam/base/random.h"

namespace demslam {
namespace {

/// Reads the code stream of one image block back to pixels, as any viewer does.
std::vector<std::uint8_t> unpacked(const std::vector<std::uint8_t>& codes) {
  std::vector<std::vector<std::uint8_t>> words;
  const auto reset = [&] {
    words.assign(258, {});
    for (int i = 0; i < 256; ++i) words[i] = {static_cast<std::uint8_t>(i)};
  };
  std::vector<std::uint8_t> pixels, last;
  std::size_t bit = 0;
  for (unsigned width = 9;;) {
    unsigned code = 0;
    for (unsigned k = 0; k < width; ++k, ++bit) code |= ((codes.at(bit / 8) >> (bit % 8)) & 1U) << k;
    if (code == 257) return pixels;
    if (code == 256) {
      reset(), last.clear(), width = 9;
      continue;
    }
    std::vector<std::uint8_t> word = last;
    if (code < words.size())
      word = words[code];
    else
      word.push_back(last.at(0));
    if (!last.empty() && words.size() < 4096) {
      words.push_back(last);
      words.back().push_back(word[0]);
    }
    if (words.size() == (1U << width) && width < 12) ++width;
    pixels.insert(pixels.end(), word.begin(), word.end());
    last = word;
  }
}

std::vector<std::uint8_t> first_codes(const std::vector<std::uint8_t>& gif) {
  std::size_t at = 6 + 7 + 768 + 19 + 8 + 10 + 1;  // header, palette, repeat, control, descriptor, code size
  std::vector<std::uint8_t> codes;
  for (; gif.at(at) != 0; at += gif[at] + 1U) {
    const auto first = gif.begin() + static_cast<std::ptrdiff_t>(at) + 1;
    codes.insert(codes.end(), first, first + gif[at]);
  }
  return codes;
}

TEST(Gif, HoldsExactlyThePixelsOfNoiseAndOfFlatGrey) {
  Random random(3);
  Image noise(173, 91), flat(64, 64, 77);
  for (auto& pixel : noise.pixels) pixel = static_cast<std::uint8_t>(random.index(256));
  for (const Image& image : {noise, flat}) {
    const auto gif = gif_bytes(std::vector<Image>{image}, 0.1);
    EXPECT_EQ(std::string(gif.begin(), gif.begin() + 6), "GIF89a");
    EXPECT_EQ(unpacked(first_codes(gif)), image.pixels);
    EXPECT_EQ(gif.back(), 0x3b);
  }
}

TEST(Gif, RefusesNoPicturesAndMixedSizes) {
  EXPECT_THROW(gif_bytes({}, 0.1), Error);
  EXPECT_THROW(gif_bytes(std::vector<Image>{Image(4, 4), Image(5, 4)}, 0.1), Error);
}

}  // namespace
}  // namespace demslam
