#pragma once

#include <utility>
#include <vector>

#include "demslam/dem/dem.h"

namespace demslam {

/// The horizon as the DEM has it from one place: elevation angle of the highest ground by azimuth, both in radians, the
/// azimuth from East towards North as the heading. Periodic, linear between its samples.
class Skyline {
 public:
  /// `elevation_rad` at azimuths 0, 2 pi / n, ...; at least three.
  explicit Skyline(std::vector<double> elevation_rad) : elevation_rad_(std::move(elevation_rad)) {}

  double elevation(double azimuth_rad) const;
  double slope(double azimuth_rad) const;  ///< derivative of elevation(), constant between two samples
  /// RMS of slope(): how well the horizon tells headings apart. Zero on a plain.
  double roughness() const;

 private:
  std::pair<std::size_t, double> place(double azimuth_rad) const;

  std::vector<double> elevation_rad_;
};

struct SkylineOptions {
  int azimuths = 1440;
  double min_range_m = 30.0;  ///< nearer ground is the DEM's errors and the rover's own place
  double max_range_m = 30000.0;
  double radius_m = 1737400.0;  ///< of the body: far ground sinks below the horizontal by d^2 / 2 r; 0: flat
};

/// Rays over the DEM from `p_map`, in steps that grow with the range. Ground beyond the DEM or in holes hides nothing.
Skyline skyline_from(const Dem& dem, const Eigen::Vector3d& p_map, const SkylineOptions& options = {});

}  // namespace demslam
