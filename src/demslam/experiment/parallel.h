#pragma once

#include <cstddef>
#include <functional>

#include "demslam/base/progress.h"

namespace demslam {

/// Calls `work(i)` for i = 0 ... count - 1 on several threads, in no order that may be relied upon. Begins nothing new
/// once `progress` asks to stop; rethrows the first exception after all have ended.
void for_each_in_parallel(std::size_t count, int threads, const Progress& progress,
                          const std::function<void(std::size_t)>& work);

}  // namespace demslam
