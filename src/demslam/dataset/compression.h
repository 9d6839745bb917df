#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace demslam {

/// How a ROS bag packs its chunks.
enum class Compression { none, bz2, lz4 };

/// The name in the bag: "none", "bz2", "lz4".
std::string name_of(Compression compression);
/// Throws Error, naming `source`, when the name is another one.
Compression compression_named(const std::string& name, const std::string& source);

std::vector<std::uint8_t> compress(std::span<const std::uint8_t> bytes, Compression compression);
/// Throws Error, naming `source`, when the bytes are damaged or do not make `size` bytes.
std::vector<std::uint8_t> decompress(std::span<const std::uint8_t> bytes, Compression compression, std::size_t size,
                                     const std::string& source);

}  // namespace demslam
