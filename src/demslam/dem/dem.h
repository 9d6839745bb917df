#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "demslam/dem/local_frame.h"

namespace demslam {

/// Height and its derivatives at a map position (docs/conventions.md, "DEM").
struct DemSample {
  double height_m = 0.0;
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();  ///< dh/dx, dh/dy
  Eigen::Matrix2d hessian = Eigen::Matrix2d::Zero();   ///< row i: derivative of gradient[i] by x and y, 1/m
};

/// A rectangle in the map frame, metres.
struct MapWindow {
  double west_m = 0.0, south_m = 0.0, east_m = 0.0, north_m = 0.0;
};

/// A part of a raster, in cells.
struct CellWindow {
  int row = 0, col = 0, rows = 0, cols = 0;
};

/// A raster of heights in the map frame: row 0 is the NORTH edge, column 0 the WEST edge, heights stand at cell
/// centres, cell (row, col) is centred at x = west_m + (col + 0.5) * cell_m, y = north_m - (row + 0.5) * cell_m.
/// No-data cells are NaN. Immutable after construction but for `heights`, which perturbations replace as a whole.
struct DemRaster {
  int rows = 0, cols = 0;
  double cell_m = 0.0;                 ///< square cells
  double west_m = 0.0, north_m = 0.0;  ///< the raster's outer corner in the map frame
  std::vector<float> heights;          ///< rows * cols, row-major, map z
  LocalFrame frame;

  float at(int row, int col) const { return heights[static_cast<std::size_t>(row) * cols + col]; }
  float& at(int row, int col) { return heights[static_cast<std::size_t>(row) * cols + col]; }
  Eigen::Vector2d centre(int row, int col) const {
    return {west_m + (col + 0.5) * cell_m, north_m - (row + 0.5) * cell_m};
  }
  MapWindow extent() const { return {west_m, north_m - rows * cell_m, west_m + cols * cell_m, north_m}; }
};

/// Reads a DEM through GDAL into the map frame, as GDAL places its cells (cell-centre "point" registration is honoured)
/// and with the band's own scale and offset. `origin`: the map's origin in the DEM's CRS (easting, northing, height);
/// by default the centre of the raster's extent, at height 0, or at the band's offset where it has one (planetary
/// radii). A PDS image (.IMG) is opened through the label beside it. Throws Error: unreadable, no georeference, degrees
/// where metres are needed, rotated, south-up or non-square cells.
DemRaster read_dem(const std::filesystem::path& file, const std::optional<Eigen::Vector3d>& origin = std::nullopt);

/// Only the cells that touch `window`, which is in the file's own map frame; nothing else is read.
DemRaster read_dem(const std::filesystem::path& file, const MapWindow& window);

/// Writes a Float32 GeoTIFF with no-data -99999 in the frame's CRS and coordinates, the map's origin and what the
/// heights count from beside them: whole or not at all. Throws Error.
void write_dem(const std::filesystem::path& file, const DemRaster& dem);

/// The cells that touch `window`. Throws Error when there are none.
CellWindow cells_in(const DemRaster& dem, const MapWindow& window);
DemRaster crop(const DemRaster& dem, const MapWindow& window);

/// bicubic: Catmull-Rom through the 4 x 4 nearest cell centres; twice differentiable inside a cell, gradient continuous
/// everywhere, and gradient and Hessian are exactly the height's own: what an optimiser wants, hence the default.
/// bilinear: height from the 2 x 2 nearest centres, gradient from central differences on the grid, interpolated
/// bilinearly (the published form): continuous, but not the derivative of that height.
enum class Interpolation { bilinear, bicubic };

class DemTiles;

/// Interpolated view of a raster. No value outside, or where a cell of the 4 x 4 stencil is no-data. May be sampled
/// from several threads at once.
class Dem {
 public:
  explicit Dem(DemRaster raster, Interpolation interpolation = Interpolation::bicubic);
  /// Heights come tile by tile as positions are asked for.
  explicit Dem(std::shared_ptr<const DemTiles> tiles, Interpolation interpolation = Interpolation::bicubic);

  std::optional<DemSample> sample(double x_m, double y_m) const;
  /// As sample(), but bilinear heights need their four cells only.
  std::optional<double> height(double x_m, double y_m) const;
  bool covers(double x_m, double y_m) const { return sample(x_m, y_m).has_value(); }
  /// Standard deviation of the height's error there; nothing without an uncertainty raster, outside it or at its holes.
  std::optional<double> sigma_m(double x_m, double y_m) const;
  bool has_sigma() const { return sigma_ != nullptr; }
  void set_sigma(std::shared_ptr<const Dem> sigma) { sigma_ = std::move(sigma); }

  const DemRaster& raster() const { return raster_; }  ///< without its heights where they come in tiles
  Interpolation interpolation() const { return interpolation_; }

 private:
  float cell(int row, int col) const;
  std::optional<Eigen::Matrix4d> stencil(int row, int col) const;
  std::optional<double> bilinear_height(int row, int col, double down, double right) const;

  DemRaster raster_;
  Interpolation interpolation_;
  std::shared_ptr<const DemTiles> tiles_;  ///< none: the raster's own heights
  std::shared_ptr<const Dem> sigma_;
};

/// Opens a DEM file for sampling: as a whole, or by tiles when it has more than 16 million cells. `sigma_file` holds
/// the standard deviation of each height's error, on any grid in the same CRS. Throws Error as read_dem() does, and
/// when the CRS of the two differ.
Dem open_dem(const std::filesystem::path& file, const std::optional<std::filesystem::path>& sigma_file = std::nullopt);

/// "dem_sigma.tif" beside "dem.tif", if it is there.
std::optional<std::filesystem::path> sigma_beside(const std::filesystem::path& dem_file);

}  // namespace demslam
