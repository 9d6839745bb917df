#include "demslam/sim/fillets.h"

#include <cmath>

namespace demslam {
namespace {

constexpr double kSmallestRock = 0.15, kHeightPerDiameter = 0.1;

void bank(Patch& patch, const RockPlace& rock) {
  const double reach = rock.diameter_m;
  const NodeSpan columns = nodes_between(patch.x0, patch.step, patch.nx, rock.p_m.x() - reach, rock.p_m.x() + reach);
  const NodeSpan rows = nodes_between(patch.y0, patch.step, patch.ny, rock.p_m.y() - reach, rock.p_m.y() + reach);
  for (int iy = rows.first; iy <= rows.last; ++iy) {
    for (int ix = columns.first; ix <= columns.last; ++ix) {
      const double distance = std::hypot(patch.x(ix) - rock.p_m.x(), patch.y(iy) - rock.p_m.y()) / reach;
      patch.row(iy)[ix] += kHeightPerDiameter * rock.diameter_m * (1.0 - smooth_step(0.35, 1.0, distance));
    }
  }
}

}  // namespace

NodeSpan nodes_between(double origin, double step, int count, double low, double high) {
  const double first = std::ceil((low - origin) / step), last = std::floor((high - origin) / step);
  return {static_cast<int>(std::fmax(first, 0.0)), static_cast<int>(std::fmin(last, count - 1.0))};
}

void Fillets::add_to(Patch& patch) const {
  const double reach = rocks_.largest_m();
  for (const RockPlace& rock : rocks_.within(low_corner(patch, reach), high_corner(patch, reach), kSmallestRock)) {
    const bool touches = rock.p_m.x() + rock.diameter_m > patch.x0 && rock.p_m.y() + rock.diameter_m > patch.y0;
    if (touches && !rocks_.blocks(rock, route_)) bank(patch, rock);
  }
}

}  // namespace demslam
