#pragma once

#include <array>

#include "demslam/sim/scene.h"

namespace demslam {

/// How brightly a surface reflects: I/F (radiance over that of a white Lambert surface lit from the zenith), tabulated
/// over the phase angle. `albedo` is I/F at zero phase, normal incidence.
///   hapke:         w/4 mu0/(mu0+mu) [(1+B(g)) P(g) + H(mu0) H(mu) - 1] (Hapke 1993), scaled to the albedo. P is a
///   double
///                  Henyey-Greenstein function, c follows b by Hapke's (2012) relation 3.29 exp(-17.4 b^2) - 0.908, B
///                  is the shadow-hiding surge. The soils differ as Sato et al. (2014) found maria and highlands to:
///                  maria darker, less backscattering, with a narrower surge; the numbers are chosen, not theirs.
///                             w     b     c     B0   h
///                  regolith   0.30  0.24  0.30  1.9  0.07
///                  mare       0.22  0.27  0.02  1.9  0.05
///                  highland   0.36  0.22  0.51  1.9  0.08
///                  No macroscopic roughness: the relief is real here.
///   lunar_lambert: albedo [2 L mu0/(mu0+mu) + (1-L) mu0], L(g) after McEwen (1991)
///   lambert:       albedo mu0
class Reflectance {
 public:
  Reflectance(Photometry model, double albedo, Soil soil = Soil::regolith);

  /// Cosines of incidence, emission (> 0) and phase. 0 when the surface is turned away from the sun.
  float operator()(float mu0, float mu, float cos_phase) const;

 private:
  static constexpr int kSteps = 1024;

  float single(float cos_phase) const;

  Photometry model_;
  float scale_ = 1.0F;
  float quarter_w_;                        ///< w / 4
  float gamma_ = 1.0F;                     ///< sqrt(1 - w)
  std::array<float, kSteps + 1> table_{};  ///< over cos(phase) from -1 to 1: (1+B) P, or L
};

}  // namespace demslam
