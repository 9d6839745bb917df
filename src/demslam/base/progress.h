#pragma once

#include <cstddef>
#include <functional>
#include <stop_token>

namespace demslam {

/// How long work reports itself and is asked to stop. The library calls `report(done, total)`; apps/ draws it.
/// A default-constructed Progress reports to nobody and never stops.
struct Progress {
  std::function<void(std::size_t done, std::size_t total)> report = [](std::size_t, std::size_t) {};
  std::stop_token stop = {};

  bool stop_requested() const { return stop.stop_requested(); }
};

}  // namespace demslam
