#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "demslam/dem/dem.h"
#include "demslam/sim/craters.h"
#include "demslam/sim/patch.h"
#include "demslam/sim/relief_law.h"
#include "demslam/sim/scene.h"

namespace demslam {

/// The ground at the scale of a raster: bicubic (Catmull-Rom, C1) between cell centres, so it passes through every
/// height of the raster. No-data cells are filled smoothly for the renderer and remembered; beyond its edge the surface
/// is mirrored.
class BaseSurface {
 public:
  explicit BaseSurface(DemRaster raster);

  /// Adds the surface to a patch, row by row.
  void add_to(Patch& patch) const;

  double cell_m() const { return raster_.cell_m; }
  const DemRaster& raster() const { return raster_; }  ///< holes filled
  bool inside(double x_m, double y_m) const;           ///< within the outermost cell centres
  bool is_hole(double x_m, double y_m) const;          ///< the nearest cell has no data in the file
  double outside_m(double x_m, double y_m) const;      ///< distance from the raster's extent; 0 inside

 private:
  std::vector<bool> hole_;  ///< of the raster as given
  DemRaster raster_;
};

/// Replaces NaN by a smooth surface that meets the data around it. Throws Error when nothing but NaN is there.
void fill_holes(DemRaster& raster);

/// The craters of a generated base of a cell size: those that its cells can hold.
CraterField base_craters(const ReliefLaw& law, std::uint64_t seed, double cell_m);

/// A generated base: octaves of noise and large craters of the law, centred on the map's origin.
DemRaster generate_base(const TerrainOptions& terrain, std::uint64_t seed);

}  // namespace demslam
