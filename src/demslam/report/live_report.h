#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>

#include "demslam/report/report_page.h"

namespace demslam {

/// One state of a run that goes on, as the page takes it.
struct LiveState {
  std::size_t number = 0;  ///< grows with every new state
  std::shared_ptr<const std::string> data;
};

/// The data of a run's page while the run goes on, made anew when its files have grown, and at most for a tenth of the
/// time. Reads the run's files alone, never the run. Any thread may ask.
class LiveReport {
 public:
  explicit LiveReport(std::filesystem::path run);
  LiveState state();
  /// The run has ended: one more state, of its complete folder.
  LiveState last_state();

 private:
  using Clock = std::chrono::steady_clock;
  bool has_grown();
  void make();

  std::filesystem::path run_;
  PageOptions options_;
  ImageCache images_;
  std::mutex mutex_;
  LiveState state_;
  std::uintmax_t seen_bytes_ = 0;
  Clock::time_point next_at_ = {};
  bool ended_ = false;
};

}  // namespace demslam
