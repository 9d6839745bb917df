#include "demslam/report/live_report.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "demslam/report/run_snapshot.h"

namespace demslam {
namespace {

constexpr std::size_t kImages = 32;
constexpr auto kAtMostEvery = std::chrono::seconds(1);
constexpr int kShareOfTime = 10;

std::string data_of(const std::filesystem::path& run, const PageOptions& options, ImageCache& images) {
  return page_data(read_report({run}, std::nullopt, std::nullopt), options, &images);
}

}  // namespace

LiveReport::LiveReport(std::filesystem::path run) : run_(std::move(run)) {
  options_.images = kImages;
  options_.live = true;
}

LiveState LiveReport::state() {
  const std::scoped_lock lock(mutex_);
  if (!ended_ && Clock::now() >= next_at_ && (has_grown() || !state_.data)) make();
  return state_;
}

LiveState LiveReport::last_state() {
  const std::scoped_lock lock(mutex_);
  if (!ended_) {
    ended_ = true;
    make();
  }
  return state_;
}

bool LiveReport::has_grown() {
  std::error_code none;
  const std::uintmax_t bytes = std::filesystem::file_size(run_ / "frames.jsonl", none);
  return !none && std::exchange(seen_bytes_, bytes) != bytes;
}

void LiveReport::make() {
  const Clock::time_point begin = Clock::now();
  std::string data;
  try {
    data = ended_ ? data_of(run_, options_, images_) : data_of(RunSnapshot(run_).path(), options_, images_);
  } catch (const std::exception&) {  // nothing to show yet; what was shown before stays, and the run is not harmed
    if (!state_.data) data = page_data({}, options_);
  }
  if (!data.empty()) state_ = {state_.number + 1, std::make_shared<const std::string>(std::move(data))};
  next_at_ = Clock::now() + std::max<Clock::duration>(kAtMostEvery, kShareOfTime * (Clock::now() - begin));
}

}  // namespace demslam
