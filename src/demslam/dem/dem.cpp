#include "demslam/dem/dem.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "demslam/base/error.h"
#include "demslam/dem/dem_reader.h"
#include "demslam/dem/dem_tiles.h"

namespace demslam {
namespace {

constexpr std::int64_t kMostCellsInMemory = 16'000'000;

/// Where a position falls between cell centres, in cells: `index` is the lower neighbour, `t` in [0, 1) the way to the
/// next.
struct Between {
  int index = 0;
  double t = 0.0;

  explicit Between(double position) : index(static_cast<int>(std::floor(position))), t(position - index) {}
};

struct CellPosition {
  Between col, row;

  CellPosition(const DemRaster& dem, double x_m, double y_m)
      : col((x_m - dem.west_m) / dem.cell_m - 0.5), row((dem.north_m - y_m) / dem.cell_m - 0.5) {}
};

bool inside(const DemRaster& dem, double x_m, double y_m) {
  const MapWindow e = dem.extent();
  return x_m >= e.west_m && x_m <= e.east_m && y_m >= e.south_m && y_m <= e.north_m;
}

/// Weights of the four nodes -1, 0, 1, 2 along one axis, per cell: for the value and its derivative, for the slope and
/// its. Where slope == value_derivative the interpolated gradient is the interpolated height's own.
struct Weights {
  Eigen::Vector4d value, value_derivative, slope, slope_derivative;
};

Weights catmull_rom(double t) {
  const double t2 = t * t, t3 = t2 * t;
  Weights w;
  w.value << -0.5 * t + t2 - 0.5 * t3, 1.0 - 2.5 * t2 + 1.5 * t3, 0.5 * t + 2.0 * t2 - 1.5 * t3, -0.5 * t2 + 0.5 * t3;
  w.slope << -0.5 + 2.0 * t - 1.5 * t2, -5.0 * t + 4.5 * t2, 0.5 + 4.0 * t - 4.5 * t2, -t + 1.5 * t2;
  w.slope_derivative << 2.0 - 3.0 * t, -5.0 + 9.0 * t, 4.0 - 9.0 * t, -1.0 + 3.0 * t;
  w.value_derivative = w.slope;
  return w;
}

Weights linear(double t) {
  Weights w;
  w.value << 0.0, 1.0 - t, t, 0.0;
  w.value_derivative << 0.0, -1.0, 1.0, 0.0;
  w.slope << 0.5 * (t - 1.0), -0.5 * t, 0.5 * (1.0 - t), 0.5 * t;  // central differences at nodes 0 and 1
  w.slope_derivative << 0.5, -0.5, -0.5, 0.5;
  return w;
}

void check_raster(const DemRaster& dem) {
  if (dem.rows < 1 || dem.cols < 1 || !(dem.cell_m > 0.0) ||
      dem.heights.size() != static_cast<std::size_t>(dem.rows) * dem.cols) {
    throw Error("DEM raster: rows, columns, cell size and the number of heights do not fit together");
  }
}

}  // namespace

Dem::Dem(DemRaster raster, Interpolation interpolation) : raster_(std::move(raster)), interpolation_(interpolation) {
  check_raster(raster_);
}

Dem::Dem(std::shared_ptr<const DemTiles> tiles, Interpolation interpolation)
    : raster_(tiles->grid()), interpolation_(interpolation), tiles_(std::move(tiles)) {}

float Dem::cell(int row, int col) const { return tiles_ ? tiles_->at(row, col) : raster_.at(row, col); }

/// The 4 x 4 heights from (row, col) on, rows from north to south; nothing outside the raster or at a hole.
std::optional<Eigen::Matrix4d> Dem::stencil(int row, int col) const {
  if (row < 0 || col < 0 || row + 4 > raster_.rows || col + 4 > raster_.cols) return std::nullopt;
  Eigen::Matrix4d heights;
  for (int r = 0; r < 4; ++r) {
    for (int c = 0; c < 4; ++c) heights(r, c) = cell(row + r, col + c);
  }
  if (!heights.allFinite()) return std::nullopt;
  return heights;
}

std::optional<double> Dem::bilinear_height(int row, int col, double down, double right) const {
  if (row < 0 || col < 0 || row + 2 > raster_.rows || col + 2 > raster_.cols) return std::nullopt;
  const double north = (1.0 - right) * cell(row, col) + right * cell(row, col + 1);
  const double south = (1.0 - right) * cell(row + 1, col) + right * cell(row + 1, col + 1);
  const double height_m = (1.0 - down) * north + down * south;
  if (!std::isfinite(height_m)) return std::nullopt;
  return height_m;
}

std::optional<DemSample> Dem::sample(double x_m, double y_m) const {
  if (!inside(raster_, x_m, y_m)) return std::nullopt;
  const CellPosition at(raster_, x_m, y_m);
  const auto heights = stencil(at.row.index - 1, at.col.index - 1);
  if (!heights) return std::nullopt;

  const bool cubic = interpolation_ == Interpolation::bicubic;
  const Weights u = cubic ? catmull_rom(at.col.t) : linear(at.col.t);  // eastward
  const Weights v = cubic ? catmull_rom(at.row.t) : linear(at.row.t);  // southward: d/dy = -d/dv
  const Eigen::Vector4d along_u = heights->transpose() * v.value;
  const Eigen::Vector4d along_u_slope = heights->transpose() * v.slope;
  const double per_m = 1.0 / raster_.cell_m;

  DemSample sample;
  sample.height_m = along_u.dot(u.value);
  sample.gradient << per_m * along_u.dot(u.slope), -per_m * along_u_slope.dot(u.value);
  sample.hessian(0, 0) = along_u.dot(u.slope_derivative);
  sample.hessian(0, 1) = -v.value_derivative.dot(*heights * u.slope);
  sample.hessian(1, 0) = -along_u_slope.dot(u.value_derivative);
  sample.hessian(1, 1) = v.slope_derivative.dot(*heights * u.value);
  sample.hessian *= per_m * per_m;
  return sample;
}

std::optional<double> Dem::height(double x_m, double y_m) const {
  if (!inside(raster_, x_m, y_m)) return std::nullopt;
  const CellPosition at(raster_, x_m, y_m);
  if (interpolation_ == Interpolation::bilinear) return bilinear_height(at.row.index, at.col.index, at.row.t, at.col.t);
  const auto heights = stencil(at.row.index - 1, at.col.index - 1);
  if (!heights) return std::nullopt;
  return catmull_rom(at.row.t).value.dot(*heights * catmull_rom(at.col.t).value);
}

std::optional<double> Dem::sigma_m(double x_m, double y_m) const {
  if (!sigma_) return std::nullopt;
  const auto sigma_m = sigma_->height(x_m, y_m);
  return sigma_m && *sigma_m > 0.0 ? sigma_m : std::nullopt;
}

CellWindow cells_in(const DemRaster& dem, const MapWindow& window) {
  const auto cells = [&](double distance_m) { return distance_m / dem.cell_m; };
  const int col0 = std::max(0, static_cast<int>(std::floor(cells(window.west_m - dem.west_m))));
  const int row0 = std::max(0, static_cast<int>(std::floor(cells(dem.north_m - window.north_m))));
  const int col1 = std::min(dem.cols, static_cast<int>(std::ceil(cells(window.east_m - dem.west_m))));
  const int row1 = std::min(dem.rows, static_cast<int>(std::ceil(cells(dem.north_m - window.south_m))));
  if (col0 >= col1 || row0 >= row1) throw Error("DEM crop: the window lies outside the DEM");
  return {row0, col0, row1 - row0, col1 - col0};
}

DemRaster crop(const DemRaster& dem, const MapWindow& window) {
  const CellWindow cells = cells_in(dem, window);
  DemRaster part{.rows = cells.rows, .cols = cells.cols, .cell_m = dem.cell_m};
  part.west_m = dem.west_m + cells.col * dem.cell_m;
  part.north_m = dem.north_m - cells.row * dem.cell_m;
  part.frame = dem.frame;
  part.heights.reserve(static_cast<std::size_t>(part.rows) * part.cols);
  for (int row = cells.row; row < cells.row + cells.rows; ++row) {
    const auto begin = dem.heights.begin() + static_cast<std::ptrdiff_t>(row) * dem.cols + cells.col;
    part.heights.insert(part.heights.end(), begin, begin + cells.cols);
  }
  return part;
}

namespace {

Dem open_either_way(const std::filesystem::path& file, const std::optional<Eigen::Vector3d>& origin,
                    Interpolation interpolation) {
  DemReader reader(file, origin);
  const DemRaster& grid = reader.grid();
  const bool small = static_cast<std::int64_t>(grid.rows) * grid.cols <= kMostCellsInMemory;
  if (small) return Dem(reader.read({0, 0, grid.rows, grid.cols}), interpolation);
  return Dem(std::make_shared<const DemTiles>(std::move(reader)), interpolation);
}

}  // namespace

Dem open_dem(const std::filesystem::path& file, const std::optional<std::filesystem::path>& sigma_file) {
  Dem dem = open_either_way(file, std::nullopt, Interpolation::bicubic);
  if (!sigma_file) return dem;
  const Eigen::Vector3d& origin = dem.raster().frame.origin;
  Dem sigma = open_either_way(*sigma_file, Eigen::Vector3d(origin.x(), origin.y(), 0.0), Interpolation::bilinear);
  if (!same_crs(dem.raster().frame, sigma.raster().frame)) {
    throw Error(sigma_file->string() + ": has another CRS than " + file.string() + "; reproject it (gdalwarp -t_srs)");
  }
  dem.set_sigma(std::make_shared<const Dem>(std::move(sigma)));
  return dem;
}

std::optional<std::filesystem::path> sigma_beside(const std::filesystem::path& dem_file) {
  std::filesystem::path beside = dem_file;
  beside.replace_filename(dem_file.stem().string() + "_sigma.tif");
  if (std::filesystem::is_regular_file(beside)) return beside;
  return std::nullopt;
}

}  // namespace demslam
