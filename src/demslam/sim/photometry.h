#pragma once

#include <array>

#include "demslam/sim/scene.h"

namespace demslam {

/// How brightly a surface reflects: I/F (radiance over that of a white Lambert surface lit from the zenith), tabulated
/// over the phase angle. `albedo` is I/F at zero phase, normal incidence.
///   hapke:         w/4 mu0/(mu0+mu) [(1+B(g)) P(g) + H(mu0) H(mu) - 1] (Hapke 1993) with w = 0.30, a double
///   Henyey-Greenstein
///                  phase function b = 0.24, c = 0.30, and the shadow-hiding surge B0 = 1.9, h = 0.07: mid-visible
///                  values of the Moon's surface (Sato et al. 2014); scaled to the albedo. No macroscopic roughness:
///                  the relief is real here.
///   lunar_lambert: albedo [2 L mu0/(mu0+mu) + (1-L) mu0], L(g) after McEwen (1991)
///   lambert:       albedo mu0
class Reflectance {
 public:
  Reflectance(Photometry model, double albedo);

  /// Cosines of incidence, emission (> 0) and phase. 0 when the surface is turned away from the sun.
  float operator()(float mu0, float mu, float cos_phase) const;

 private:
  static constexpr int kSteps = 1024;

  float single(float cos_phase) const;

  Photometry model_;
  float scale_ = 1.0F;
  float gamma_ = 1.0F;                     ///< sqrt(1 - w)
  std::array<float, kSteps + 1> table_{};  ///< over cos(phase) from -1 to 1: (1+B) P, or L
};

}  // namespace demslam
