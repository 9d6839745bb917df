#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "demslam/sim/base_surface.h"
#include "demslam/sim/craters.h"
#include "demslam/sim/noise.h"
#include "demslam/sim/patch.h"

namespace demslam {

/// The ground without its rocks: base surface + fractal relief + small craters. One truth for everybody: the rover
/// rides height(), the renderer shows it, the DEM product averages it. Memory does not grow with the area looked at.
class Terrain {
 public:
  /// Reads or generates the base. Throws Error when the DEM cannot be read.
  Terrain(const TerrainOptions& options, std::uint64_t seed);
  /// With a base of the caller's own.
  Terrain(const TerrainOptions& options, std::uint64_t seed, DemRaster base);

  static constexpr double kFinestStep = 0.02;  ///< metres; the finest grid that height() is made for

  /// Heights at the patch's nodes, map z; detail that the patch's step cannot hold (wavelengths below two steps,
  /// craters below three) is left out.
  void fill(Patch& patch) const;
  /// The full surface at a point.
  double height(double x_m, double y_m) const;
  /// The texture too fine for a patch of this step, down to `shortest_m`: it shades, but moves no geometry. Slopes at
  /// the places of a packet.
  void micro_relief(const double* x_m, const double* y_m, const float* step_m, const float* shortest_m, float* slope_x,
                    float* slope_y) const;
  /// Relative albedo at the patch's nodes, mean 1.
  void fill_albedo(Patch& patch) const;

  /// Craters (those of the fine relief and of a generated base) of at least a diameter, around a position.
  std::vector<Crater> craters(const Eigen::Vector2d& centre, double reach_m, double min_diameter_m) const;

  const BaseSurface& base() const { return base_; }

 private:
  ReliefLaw law_;
  std::uint64_t seed_;
  BaseSurface base_;
  std::vector<Noise> fine_;  ///< octaves below the base, shortest first
  std::vector<Noise> albedo_;
  CraterField craters_, base_craters_;  ///< finer than the base; in the base, if that is generated
};

}  // namespace demslam
