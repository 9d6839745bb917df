#include "demslam/slam/slam.h"

#include <utility>

namespace demslam {

Slam::Slam(const RectifiedRig& rig, Frontend frontend, std::shared_ptr<const Dem> dem, const StartPrior& start,
           const SlamOptions& options, FeatureSource stored)
    : odometry_(rig, std::move(frontend), options.odometry),
      backend_(rig, odometry_.matcher(), std::move(dem), start, options, std::move(stored)) {}

FrameRecord Slam::process(Observation observation) {
  const Stopwatch total;
  const double observed_ms = observation.timings.extract_ms + observation.timings.stereo_ms;
  FrameRecord record = backend_.add(odometry_.process(std::move(observation)));
  record.total_ms = observed_ms + total.elapsed_ms();
  return record;
}

}  // namespace demslam
