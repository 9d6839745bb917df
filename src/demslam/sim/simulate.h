#pragma once

#include <cstddef>
#include <filesystem>

#include "demslam/base/progress.h"
#include "demslam/sim/scene.h"

namespace demslam {

/// What a simulation did, for the caller to print.
struct SimulationReport {
  std::size_t frames = 0;    ///< of the whole sequence
  std::size_t rendered = 0;  ///< in this call; the others were complete already
  double length_m = 0.0;     ///< driven distance
  double exposure = 0.0;     ///< grey value per unit of I/F that was used
  double elapsed_s = 0.0;
  double render_ms_per_frame = 0.0;  ///< both cameras, depth and files included
  bool stopped = false;              ///< asked to stop before the last frame; the same call goes on from there
};

/// Pictures of the mission to look at (MissionPictures); an empty path: not wanted.
struct PictureFiles {
  std::filesystem::path contact_sheet, video;
};

/// Renders a mission into a `demslam` dataset: the LuSNAR layout (image0/color, image1/color, image0/depth, gt.txt)
/// plus calibration.toml, start.toml, dem.tif (what the mission has) and scene.toml; truth/dem_truth.tif is for
/// evaluation only. A folder of the same scene is resumed at the first incomplete frame; a folder of another scene is
/// refused. With output.images = false all but the frames is written: `run` renders them when it reads them
/// (rendered_sequence.h). Same scene, same bytes, on any number of threads. Throws Error: unwritable folder, full disk,
/// route off the DEM or through a hole.
SimulationReport simulate(const SceneOptions& scene, const std::filesystem::path& out, const Progress& progress = {},
                          const PictureFiles& pictures = {});

}  // namespace demslam
