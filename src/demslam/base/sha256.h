#pragma once

#include <filesystem>
#include <string>

namespace demslam {

/// SHA-256 of a file's bytes, as 64 lower-case hexadecimal digits. Throws Error when it cannot be read.
std::string sha256_of_file(const std::filesystem::path& file);

/// SHA-256 of a string's bytes.
std::string sha256_of(const std::string& bytes);

}  // namespace demslam
