#pragma once

namespace demslam {

struct PatchFactorOptions {
  double information_scale =
      0.6;                     ///< neighbouring patches lie on the same errors of the DEM, and its model is not exact
  double soft_sigmas = 4.0;    ///< a cell's residual grows only logarithmically beyond this many standard deviations
  double kernel_sigmas = 2.5;  ///< Cauchy on the patch, per square root of its number of cells
};

}  // namespace demslam
