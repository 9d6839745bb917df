#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "demslam/sim/base_surface.h"
#include "demslam/sim/craters.h"
#include "demslam/sim/ground_layer.h"
#include "demslam/sim/noise.h"
#include "demslam/sim/patch.h"
#include "demslam/sim/relief_law.h"
#include "demslam/sim/rock_population.h"

namespace demslam {

/// The ground: base surface + fractal relief + craters, and hills beyond the base's edge, up to the horizon; the rocks
/// that lie on it; and layers that others have put on top (soil against rocks, wheel tracks). One truth for everybody:
/// the renderer shows fill(), the rover rides and the DEM product averages fill_ground(). Memory does not grow with the
/// area looked at.
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
  /// The same without the layers.
  void fill_ground(Patch& patch) const;
  /// The full surface at a point, with and without the layers.
  double height(double x_m, double y_m) const;
  double ground_height(double x_m, double y_m) const;
  /// The texture too fine for a patch of this step, down to `shortest_m`: it shades, but moves no geometry. Slopes at
  /// the places of a packet.
  void micro_relief(const double* x_m, const double* y_m, const float* step_m, const float* shortest_m, float* slope_x,
                    float* slope_y) const;
  /// Relative albedo at the patch's nodes, mean 1.
  void fill_albedo(Patch& patch) const;

  /// Craters (placed, fresh, those of the fine relief and of a generated base) of at least a diameter, around a
  /// position.
  std::vector<Crater> craters(const Eigen::Vector2d& centre, double reach_m, double min_diameter_m) const;

  void add_layer(std::shared_ptr<const GroundLayer> layer) { layers_.push_back(std::move(layer)); }
  /// Changes when a layer has.
  std::uint64_t revision() const;

  const BaseSurface& base() const { return base_; }
  const RockPopulation& rocks() const { return rocks_; }
  const ReliefLaw& law() const { return law_; }
  std::uint64_t seed() const { return seed_; }

 private:
  void add_horizon(Patch& patch) const;

  ReliefLaw law_;
  std::uint64_t seed_;
  BaseSurface base_;
  std::vector<Noise> fine_, hills_;  ///< octaves below the base and beyond its edge, shortest first
  std::vector<Noise> albedo_;
  CraterField craters_, base_craters_, fresh_;  ///< finer than the base; in the base, if that is generated; rare
  std::vector<Crater> placed_;
  RockPopulation rocks_;
  std::vector<std::shared_ptr<const GroundLayer>> layers_;
};

}  // namespace demslam
