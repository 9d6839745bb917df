#include "demslam/anchoring/believed_terrain.h"

#include <algorithm>
#include <utility>

namespace demslam {
namespace {

constexpr double kReach_m = 250.0, kReachCells = 100.0;

}  // namespace

BelievedTerrain::BelievedTerrain(std::shared_ptr<const Dem> dem, const DemErrorModel& stated, bool filter,
                                 bool estimate_noise)
    : dem_(std::move(dem)),
      estimate_noise_(estimate_noise),
      noise_(dem_, stated, filter, estimate_noise),
      reach_m_(std::max(kReach_m, kReachCells * dem_->raster().cell_m)) {}

const BelievedDem& BelievedTerrain::around(const Eigen::Vector2d& place_m) {
  const WienerFilter* filter = noise_.filter();
  const MapWindow window{place_m.x() - reach_m_, place_m.y() - reach_m_, place_m.x() + reach_m_,
                         place_m.y() + reach_m_};
  if (!touch(window, dem_->raster().extent())) filter = nullptr;
  const bool far = (place_m - middle_m_).lpNorm<Eigen::Infinity>() > 0.5 * reach_m_;
  if (filter == nullptr) {
    believed_.dem = dem_;
  } else if (filter != made_with_ || far) {
    believed_.dem = std::make_shared<Dem>(filter->filtered(dem_->raster(), window), dem_->interpolation());
    middle_m_ = place_m;
  }
  made_with_ = filter;
  believed_.error = noise_.error();
  return believed_;
}

}  // namespace demslam
