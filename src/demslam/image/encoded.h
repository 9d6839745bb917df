#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace demslam {

/// The bytes of an image file. Throws Error naming it when it is missing, a folder, empty or unreadable.
std::vector<std::uint8_t> read_encoded(const std::filesystem::path& file);

/// Throws Error when the bytes are a PNG or a JPEG that ends early: decoders fill the rest with grey and say nothing.
void check_complete(std::span<const std::uint8_t> bytes, const std::filesystem::path& file);

/// Writes bytes to a file. Throws Error, and leaves no half file behind, when the folder is missing or not writable or
/// the disk is full.
void write_encoded(const std::filesystem::path& file, std::span<const std::uint8_t> bytes);

}  // namespace demslam
