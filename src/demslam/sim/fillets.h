#pragma once

#include <memory>

#include "demslam/sim/ground_layer.h"
#include "demslam/sim/rock_population.h"

namespace demslam {

/// Regolith banked up against rocks: around each rock of at least 0.15 m a ramp of a tenth of its diameter, highest
/// against the rock and gone a diameter away from its centre. Rocks that block the route are gone, and so is theirs.
class Fillets : public GroundLayer {
 public:
  Fillets(const RockPopulation& rocks, const Route& route) : rocks_(rocks), route_(route) {}
  void add_to(Patch& patch) const override;

 private:
  const RockPopulation& rocks_;
  const Route& route_;
};

}  // namespace demslam
