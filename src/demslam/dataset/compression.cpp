#include "demslam/dataset/compression.h"

#include <bzlib.h>
#include <lz4frame.h>

#include <memory>

#include "demslam/base/error.h"

namespace demslam {
namespace {

using Bytes = std::vector<std::uint8_t>;
using ByteSpan = std::span<const std::uint8_t>;

/// bzip2's interface takes char* and promises not to write to the source.
char* chars(const std::uint8_t* bytes) { return reinterpret_cast<char*>(const_cast<std::uint8_t*>(bytes)); }

bool unpack_bz2(ByteSpan packed, Bytes& unpacked) {
  auto size = static_cast<unsigned>(unpacked.size());
  const int result = BZ2_bzBuffToBuffDecompress(chars(unpacked.data()), &size, chars(packed.data()),
                                                static_cast<unsigned>(packed.size()), 0, 0);
  return result == BZ_OK && size == unpacked.size();
}

bool unpack_lz4(ByteSpan packed, Bytes& unpacked) {
  LZ4F_dctx* raw = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION))) return false;
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(raw,
                                                                                     LZ4F_freeDecompressionContext);
  std::size_t made = unpacked.size(), used = packed.size();
  const std::size_t left = LZ4F_decompress(raw, unpacked.data(), &made, packed.data(), &used, nullptr);
  return left == 0 && made == unpacked.size();
}

Bytes pack_bz2(ByteSpan bytes) {
  auto size = static_cast<unsigned>(bytes.size() + bytes.size() / 100 + 600);  // the bound that its manual states
  Bytes packed(size);
  const int result = BZ2_bzBuffToBuffCompress(chars(packed.data()), &size, chars(bytes.data()),
                                              static_cast<unsigned>(bytes.size()), 9, 0, 0);
  if (result != BZ_OK) throw Error("bzip2 cannot compress " + std::to_string(bytes.size()) + " bytes");
  packed.resize(size);
  return packed;
}

Bytes pack_lz4(ByteSpan bytes) {
  Bytes packed(LZ4F_compressFrameBound(bytes.size(), nullptr));
  const std::size_t size = LZ4F_compressFrame(packed.data(), packed.size(), bytes.data(), bytes.size(), nullptr);
  if (LZ4F_isError(size)) throw Error("lz4 cannot compress " + std::to_string(bytes.size()) + " bytes");
  packed.resize(size);
  return packed;
}

}  // namespace

std::string name_of(Compression compression) {
  return compression == Compression::none ? "none" : compression == Compression::bz2 ? "bz2" : "lz4";
}

Compression compression_named(const std::string& name, const std::string& source) {
  for (const Compression compression : {Compression::none, Compression::bz2, Compression::lz4}) {
    if (name == name_of(compression)) return compression;
  }
  throw Error(source + ": unknown compression '" + name + "'; known are none, bz2 and lz4");
}

Bytes compress(ByteSpan bytes, Compression compression) {
  switch (compression) {
    case Compression::bz2:
      return pack_bz2(bytes);
    case Compression::lz4:
      return pack_lz4(bytes);
    case Compression::none:
      break;
  }
  return {bytes.begin(), bytes.end()};
}

Bytes decompress(ByteSpan bytes, Compression compression, std::size_t size, const std::string& source) {
  if (compression == Compression::none) return {bytes.begin(), bytes.end()};
  Bytes unpacked(size);
  const bool whole = compression == Compression::bz2 ? unpack_bz2(bytes, unpacked) : unpack_lz4(bytes, unpacked);
  if (!whole) throw Error(source + ": a " + name_of(compression) + " chunk cannot be unpacked; the file is damaged");
  return unpacked;
}

}  // namespace demslam
