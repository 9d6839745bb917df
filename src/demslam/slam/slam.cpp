#include "demslam/slam/slam.h"

#include <utility>

namespace demslam {

Slam::Slam(const RectifiedRig& rig, Frontend frontend, std::shared_ptr<const Dem> dem, const StartPrior& start,
           const SlamOptions& options, FeatureSource stored)
    : odometry_(rig, std::move(frontend), options.odometry),
      backend_(rig, odometry_.matcher(), std::move(dem), start, options, std::move(stored)) {}

FrameRecord Slam::process(TimestampNs t_ns, const Image& left, const Image& right) {
  const Stopwatch total;
  FrameRecord record = backend_.add(odometry_.process(t_ns, left, right));
  record.total_ms = total.elapsed_ms();
  return record;
}

}  // namespace demslam
