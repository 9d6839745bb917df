#pragma once

#include <cstdint>

namespace demslam {

/// Counter-based random numbers: the same on every machine and compiler, unlike std:: distributions.
/// SplitMix64 (Steele, Lea, Flood 2014) as generator and as hash of a seed and a stream.
class Random {
 public:
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0)
      : state_(mix(seed) ^ mix(stream + 0x9e3779b97f4a7c15ULL)) {}

  std::uint64_t next() { return mix(state_ += 0x9e3779b97f4a7c15ULL); }
  /// Uniform in [0, 1).
  double uniform() { return static_cast<double>(next() >> 11) * 0x1.0p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Uniform in {0, ..., count - 1}; count > 0.
  std::uint64_t index(std::uint64_t count) { return next() % count; }
  /// Standard normal (Box-Muller).
  double normal();

  /// A well-mixed hash of one word; mix(mix(a) ^ b) hashes two.
  static std::uint64_t mix(std::uint64_t word) {
    word = (word ^ (word >> 30)) * 0xbf58476d1ce4e5b9ULL;
    word = (word ^ (word >> 27)) * 0x94d049bb133111ebULL;
    return word ^ (word >> 31);
  }

 private:
  std::uint64_t state_;
  double spare_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace demslam
