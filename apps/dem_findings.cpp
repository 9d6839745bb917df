#include "dem_findings.h"

#include <fmt/format.h>

namespace demslam::apps {

void print_dem_findings(const SlamResult& result) {
  if (result.dem_shift) fmt::print("  {}\n", result.dem_shift->text());
  const double noise_scale = result.counters.anchoring.noise_scale;
  if (noise_scale > 1.0) {
    fmt::print("  the DEM shows about {:.1f} times the noise that was stated ([anchoring] sigma_dem_m)\n", noise_scale);
  }
}

}  // namespace demslam::apps
