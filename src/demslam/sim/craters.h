#pragma once

#include <cstdint>
#include <vector>

#include "demslam/sim/patch.h"

namespace demslam {

struct Crater {
  double x_m = 0.0, y_m = 0.0, diameter_m = 1.0;
  double depth_m = 0.1;  ///< rim crest to floor is depth_m + rim_m
  double rim_m = 0.0;

  double reach_m() const { return diameter_m; }  ///< no influence beyond this distance from the centre
  /// Height against the untouched ground at a distance from the centre; C1, zero from reach_m() on.
  double profile_m(double distance_m) const;
};

/// A crater of a diameter and an age: 0 is fresh (rim crest to floor 0.17 D), each 1 makes it shallower by e, and its
/// rim, which erodes first, lower by e^1.5.
Crater aged_crater(double x_m, double y_m, double diameter_m, double age);

/// A random population of craters, N(>D) = density * 0.079 D^-2 per square metre (Trask's equilibrium), of evenly
/// distributed ages; each depends on the seed and its place alone, so any region can be asked for at any time.
struct CraterField {
  std::uint64_t seed = 0;
  double density = 1.0;
  double smallest_m = 0.25, largest_m = 20.0;  ///< diameters
  double youngest = 0.0, oldest = 3.0;         ///< ages

  /// All craters that reach into the rectangle and have at least `min_diameter_m`, in a fixed order.
  std::vector<Crater> within(double west, double south, double east, double north, double min_diameter_m) const;

  /// Adds the population to a patch. Craters fade out between 6 and 3 `resolution_m` of diameter.
  void add_to(Patch& patch, double resolution_m) const;
};

/// Adds one crater to a patch, times `weight`.
void dig(Patch& patch, const Crater& crater, double weight = 1.0);

}  // namespace demslam
