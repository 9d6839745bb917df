#pragma once

#include <cmath>

#include "demslam/sim/scene.h"
#include "demslam/sim/terrain.h"

namespace demslam {

/// Scenes for the tests whose answers are known in closed form.
inline TerrainOptions smooth_ground() {
  TerrainOptions options;
  options.relief = Relief::flat;
  options.roughness = options.crater_density = options.rock_abundance = options.albedo_variation = 0.0;
  return options;
}

/// A square raster about the origin with z = height + slope . (x, y).
inline DemRaster plane_raster(double height_m, const Eigen::Vector2d& slope, int cells = 400, double cell_m = 1.0) {
  DemRaster raster;
  raster.rows = raster.cols = cells;
  raster.cell_m = cell_m;
  raster.west_m = -0.5 * cells * cell_m;
  raster.north_m = 0.5 * cells * cell_m;
  for (int row = 0; row < cells; ++row) {
    for (int col = 0; col < cells; ++col) {
      raster.heights.push_back(static_cast<float>(height_m + slope.dot(raster.centre(row, col))));
    }
  }
  return raster;
}

/// A perfect small camera, whose pixels are points, over smooth ground; Lambert's law, the sun in the East.
inline SceneOptions closed_form_scene() {
  SceneOptions scene;
  scene.terrain = smooth_ground();
  scene.light = {30.0, 0.0, Photometry::lambert, 0.5, 0.0, 0.0, 0.0};
  scene.camera.width_px = scene.camera.height_px = 128;
  scene.camera.full_well_e = 0.0;
  scene.camera.blur_px = scene.camera.vignetting = 0.0;
  scene.camera.smooth_edges = false;
  return scene;
}

}  // namespace demslam
