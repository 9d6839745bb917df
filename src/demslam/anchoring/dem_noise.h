#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "demslam/anchoring/terrain_patch.h"
#include "demslam/dem/dem.h"
#include "demslam/dem/error_model.h"
#include "demslam/dem/wiener.h"

namespace demslam {

/// How much larger the DEM's error is than was said, as the patches of a drive tell. Each is held against the DEM where
/// the estimate puts it, with what the pose may still be off by taken out (height, tilt, and a shift along the DEM's
/// slopes), so that only the shape counts. Of several levels of noise the one wins whose filtered DEM fits the patches
/// best, whatever the spectrum of the noise: the patches have not seen the DEM. Only levels count whose noise the DEM
/// itself shows all over (WienerFilter::noise_found): on a crest a filter that is too wide may fit in shape and be a
/// metre too low. What was said is left only where another level fits better by far (30 % of the mean square), and
/// never for less: a fit is no reason to trust a map more than its makers do. Old patches are slowly forgotten.
class DemNoise {
 public:
  /// Of a DEM as given. Without `filter`, or where it cannot be filtered, or without `levels`, the only level is what
  /// was said.
  DemNoise(std::shared_ptr<const Dem> dem, const DemErrorModel& stated, bool filter, bool levels = true);

  /// A patch at its present pose.
  void add(const TerrainPatch& patch, const Pose& T_map_body);
  /// The DEM's noise over what was said: 1 without patches, and in steps of a factor sqrt(2) where it can be filtered;
  /// where not, what the patches leave over what they should leave (standard deviations).
  double scale() const;
  /// Of the DEM as filtered for that noise, or as given. A level may fit best although there is less noise than it
  /// stands for (where the ground is smoother than its spectrum says, or the noise is): the less the patches leave, the
  /// less is the error, though never less than where what was said is true.
  DemErrorModel error() const;
  /// For that noise; null where the DEM is not filtered.
  const WienerFilter* filter() const { return levels_[best_].filter ? &*levels_[best_].filter : nullptr; }

 private:
  struct Level {
    double scale = 1.0;
    std::optional<WienerFilter> filter;
    DemErrorModel error;  ///< of the DEM filtered so, for that noise
    /// Mean squares that the patches leave, and should leave: sums over them.
    double left_m2 = 0.0, expected_m2 = 0.0;
  };
  /// False where too little of it lies on the DEM.
  bool add(const TerrainPatch& patch, const Pose& T_map_body, Level& level);
  /// Mean square that a patch should leave at a level.
  double expected_m2(const Level& level) const;
  /// Sum of the mean squares that the patches leave, those that stand for what was said among them.
  double misfit_m2(const Level& level) const;
  /// What they leave over what they should, standard deviations.
  double surprise(const Level& level) const;

  std::shared_ptr<const Dem> dem_;
  std::vector<Level> levels_;
  std::size_t best_ = 0;
  double patches_ = 0.0;   ///< that are not forgotten
  double stated_patches_;  ///< what was said counts like so many, and is forgotten like them
};

}  // namespace demslam
