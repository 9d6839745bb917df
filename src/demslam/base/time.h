#pragma once

#include <chrono>
#include <cstdint>
#include <ctime>

namespace demslam {

/// Nanoseconds since the sequence's own epoch. Never a double: EuRoC stamps do not fit one.
using TimestampNs = std::int64_t;

inline constexpr double kSecondsPerNs = 1e-9;

inline double to_seconds(TimestampNs t_ns) { return static_cast<double>(t_ns) * kSecondsPerNs; }

/// Wall-clock stopwatch for statistics; never an input to an algorithm.
class Stopwatch {
 public:
  double elapsed_ms() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// The same for the processor time of the whole process, which other programs do not lengthen.
class CpuStopwatch {
 public:
  double elapsed_ms() const { return 1e3 * static_cast<double>(std::clock() - start_) / CLOCKS_PER_SEC; }

 private:
  std::clock_t start_ = std::clock();
};

}  // namespace demslam
