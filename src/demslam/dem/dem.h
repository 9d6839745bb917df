#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <limits>
#include <optional>
#include <vector>

#include "demslam/dem/local_frame.h"

namespace demslam {

/// Height and its gradient at a map position (mathematics.md, "DEM").
struct DemSample {
  double height_m = 0.0;
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();  ///< dh/dx, dh/dy
  Eigen::Matrix2d hessian = Eigen::Matrix2d::Zero();   ///< derivative of the (interpolated) gradient
};

/// A raster of heights in the map frame: row 0 is the NORTH edge, column 0 the WEST edge, heights stand at cell centres,
/// cell (row, col) is centred at x = west_m + (col + 0.5) * cell_m, y = north_m - (row + 0.5) * cell_m.
/// No-data cells are NaN. Immutable after construction but for `heights`, which perturbations replace as a whole.
struct DemRaster {
  int rows = 0, cols = 0;
  double cell_m = 0.0;            ///< square cells
  double west_m = 0.0, north_m = 0.0;  ///< the raster's outer corner in the map frame
  std::vector<float> heights;     ///< rows * cols, row-major, map z
  LocalFrame frame;

  float at(int row, int col) const { return heights[static_cast<std::size_t>(row) * cols + col]; }
  float& at(int row, int col) { return heights[static_cast<std::size_t>(row) * cols + col]; }
  Eigen::Vector2d centre(int row, int col) const {
    return {west_m + (col + 0.5) * cell_m, north_m - (row + 0.5) * cell_m};
  }
};

/// Reads a DEM through GDAL into the map frame. `origin`: the map's origin in the DEM's CRS (easting, northing, height);
/// by default the centre of the raster's extent at height 0. Cell-centre ("point") registration is honoured.
/// Throws Error: unreadable, no georeference, geographic degrees where metres are needed, rotated or non-square cells.
DemRaster read_dem(const std::filesystem::path& file, const std::optional<Eigen::Vector3d>& origin = std::nullopt);

/// Writes a Float32 GeoTIFF with no-data -99999 in the frame's CRS and coordinates. Throws Error.
void write_dem(const std::filesystem::path& file, const DemRaster& dem);

/// Interpolated view of a raster: heights bilinear between the four nearest cell centres; central-difference gradients on
/// the grid, interpolated bilinearly, so that they are continuous. No value outside, or where a needed cell is no-data.
class Dem {
 public:
  explicit Dem(DemRaster raster);

  std::optional<DemSample> sample(double x_m, double y_m) const;
  std::optional<double> height(double x_m, double y_m) const;
  bool covers(double x_m, double y_m) const { return sample(x_m, y_m).has_value(); }
  const DemRaster& raster() const { return raster_; }

 private:
  DemRaster raster_;
  std::vector<float> gradient_x_, gradient_y_;  ///< NaN where a neighbour is missing
};

}  // namespace demslam
