#pragma once

#include <ctime>

namespace demslam {

/// Stopwatch for the processor time of the calling thread alone; for statistics, never an input to an algorithm.
class ThreadCpuStopwatch {
 public:
  double elapsed_ms() const { return now_ms() - start_ms_; }

 private:
  static double now_ms() {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
  }

  double start_ms_ = now_ms();
};

}  // namespace demslam
