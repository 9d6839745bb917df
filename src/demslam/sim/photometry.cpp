#include "demslam/sim/photometry.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace demslam {
namespace {

struct HapkeParameters {
  double w, b, c, surge, surge_width;
};

HapkeParameters parameters_of(Soil soil) {
  switch (soil) {
    case Soil::mare:
      return {0.22, 0.27, 0.02, 1.9, 0.05};
    case Soil::highland:
      return {0.36, 0.22, 0.51, 1.9, 0.08};
    case Soil::regolith:
      break;
  }
  return {0.30, 0.24, 0.30, 1.9, 0.07};
}

double hapke_phase(const HapkeParameters& soil, double cos_phase) {
  const double phase = std::acos(cos_phase), b2 = soil.b * soil.b;
  const double back = (1.0 - b2) / std::pow(1.0 - 2.0 * soil.b * cos_phase + b2, 1.5);
  const double forward = (1.0 - b2) / std::pow(1.0 + 2.0 * soil.b * cos_phase + b2, 1.5);
  const double surge = soil.surge / (1.0 + std::tan(0.5 * phase) / soil.surge_width);
  return (1.0 + surge) * (0.5 * (1.0 + soil.c) * back + 0.5 * (1.0 - soil.c) * forward);
}

double mcewen(double cos_phase) {
  const double g = std::acos(cos_phase) * 180.0 / std::numbers::pi;
  return std::clamp(1.0 - 0.019 * g + 2.42e-4 * g * g - 1.46e-6 * g * g * g, 0.0, 1.0);
}

/// Hapke's approximation of Chandrasekhar's H.
float multiple(float mu, float gamma) { return (1.0F + 2.0F * mu) / (1.0F + 2.0F * mu * gamma); }

}  // namespace

Reflectance::Reflectance(Photometry model, double albedo, Soil soil) : model_(model) {
  const HapkeParameters parameters = parameters_of(soil);
  gamma_ = static_cast<float>(std::sqrt(1.0 - parameters.w));
  quarter_w_ = static_cast<float>(0.25 * parameters.w);
  for (int i = 0; i <= kSteps; ++i) {
    const double cos_phase = std::clamp(2.0 * i / kSteps - 1.0, -1.0 + 1e-9, 1.0);
    table_[i] = static_cast<float>(model == Photometry::hapke ? hapke_phase(parameters, cos_phase) : mcewen(cos_phase));
  }
  scale_ = static_cast<float>(albedo / (*this)(1.0F, 1.0F, 1.0F));
}

float Reflectance::single(float cos_phase) const {
  const float position = std::clamp(0.5F * (cos_phase + 1.0F), 0.0F, 1.0F) * kSteps;
  const int i = std::min(static_cast<int>(position), kSteps - 1);
  return table_[i] + (position - static_cast<float>(i)) * (table_[i + 1] - table_[i]);
}

float Reflectance::operator()(float mu0, float mu, float cos_phase) const {
  if (mu0 <= 0.0F) return 0.0F;
  if (model_ == Photometry::lambert) return scale_ * mu0;
  const float seeliger = mu0 / (mu0 + std::max(mu, 1e-3F));
  if (model_ == Photometry::lunar_lambert) {
    const float weight = single(cos_phase);
    return scale_ * (2.0F * weight * seeliger + (1.0F - weight) * mu0);
  }
  const float body = single(cos_phase) + multiple(mu0, gamma_) * multiple(mu, gamma_) - 1.0F;
  return scale_ * quarter_w_ * seeliger * body;
}

}  // namespace demslam
