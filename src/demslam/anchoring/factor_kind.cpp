#include "demslam/anchoring/factor_kind.h"

#include <gtsam/nonlinear/PriorFactor.h>

#include "demslam/anchoring/dem_factors.h"
#include "demslam/anchoring/dem_shift_factor.h"
#include "demslam/anchoring/patch_factor.h"
#include "demslam/anchoring/sky_factors.h"

namespace demslam {
namespace {

template <class Factor>
bool is(const gtsam::NonlinearFactor& factor) {
  return dynamic_cast<const Factor*>(&factor) != nullptr;
}

}  // namespace

std::string factor_kind(const gtsam::NonlinearFactor& factor) {
  if (const auto* shifted = dynamic_cast<const DemShiftFactor*>(&factor)) return factor_kind(shifted->on_fixed_dem());
  if (is<DemHeightFactor>(factor)) return "dem_height";
  if (is<DemNormalFactor>(factor)) return "dem_normal";
  if (is<TerrainPatchFactor>(factor)) return "terrain_patch";
  if (is<DirectionFactor>(factor)) return "sun";
  if (is<SkylineFactor>(factor)) return "skyline";
  if (is<gtsam::PriorFactor<gtsam::Pose3>>(factor)) return "prior";
  return "";
}

}  // namespace demslam
