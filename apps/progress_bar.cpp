#include "progress_bar.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

#include "commands.h"
#include "demslam/base/time.h"

namespace demslam::apps {
namespace {

constexpr double kFirstDrawMs = 1000.0, kRedrawMs = 200.0;
constexpr std::size_t kWidth = 30;

}  // namespace

struct ProgressBar::State {
  std::string label, unit;
  bool terminal = isatty(STDERR_FILENO) != 0;
  bool drawn = false;
  std::size_t first = 0;
  bool started = false;
  double last_draw_ms = kFirstDrawMs - kRedrawMs;
  Stopwatch stopwatch;

  void draw(std::size_t done, std::size_t total) {
    if (!started) first = done;  // a resumed job starts in the middle: the rate counts only what this process did
    started = true;
    const double elapsed_ms = stopwatch.elapsed_ms();
    if (!terminal || total == 0 || elapsed_ms < kFirstDrawMs) return;
    if (done < total && elapsed_ms - last_draw_ms < kRedrawMs) return;
    last_draw_ms = elapsed_ms;
    drawn = true;
    const double rate = static_cast<double>(done - first) / (elapsed_ms * 1e-3);
    const std::size_t filled = kWidth * done / total;
    const double left_s = rate > 0.0 ? static_cast<double>(total - done) / rate : 0.0;
    fmt::print(stderr, "\r{}  [{:#<{}}{:.<{}}]  {}/{}  {:.1f} {}/s  {:.0f} s left   ", label, "", filled, "",
               kWidth - filled, done, total, rate, unit, left_s);
    std::fflush(stderr);
  }
};

ProgressBar::ProgressBar(std::string label, std::string unit) : state_(std::make_shared<State>()) {
  state_->label = std::move(label);
  state_->unit = std::move(unit);
}

ProgressBar::~ProgressBar() {
  if (state_->drawn) fmt::print(stderr, "\n");
}

Progress ProgressBar::progress() {
  return Progress{.report = [state = state_](std::size_t done, std::size_t total) { state->draw(done, total); },
                  .stop = interrupt().get_token()};
}

}  // namespace demslam::apps
