#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "demslam/sim/fillets.h"
#include "demslam/sim/terrain.h"
#include "demslam/sim/test_scenes.h"
#include "demslam/sim/wheel_tracks.h"

namespace demslam {
namespace {

Route straight_route(double length_m) {
  RoverOptions rover;
  rover.length_m = length_m;
  return Route(rover);
}

Patch ruts(const WheelTracks& tracks, double x, double y, int nodes = 60) {
  Patch patch(x, y, 0.02, nodes, nodes);
  tracks.add_to(patch);
  return patch;
}

TEST(WheelTracks, AreTwoRutsBehindTheRoverAndNothingAhead) {
  const Route route = straight_route(60.0);
  WheelTracks tracks(route, 1.0);
  tracks.set_driven(30.0);
  const Patch behind = ruts(tracks, 10.0, -0.7, 80), ahead = ruts(tracks, 31.0, -0.7, 80);
  for (int ix = 0; ix < 80; ++ix) {
    EXPECT_NEAR(behind.at(ix, 10), -0.018, 0.004);  // y = -0.5: the right wheels
    EXPECT_NEAR(behind.at(ix, 60), -0.018, 0.004);  // y = +0.5
    EXPECT_NEAR(behind.at(ix, 35), 0.0, 1e-3);      // between them
    EXPECT_GT(behind.at(ix, 17), 0.002);            // the rim beside a rut
  }
  for (const double value : ahead.values) EXPECT_EQ(value, 0.0);
}

TEST(WheelTracks, DependOnThePlaceAndNotOnThePatch) {
  RoverOptions rover;
  rover.route = RouteKind::loop;
  rover.length_m = 40.0;
  const Route route(rover);
  WheelTracks tracks(route, 1.0);
  tracks.set_driven(41.0);
  const Patch whole = ruts(tracks, -1.0, -1.0, 200), part = ruts(tracks, -1.0 + 50 * 0.02, -1.0 + 30 * 0.02, 40);
  for (int iy = 0; iy < 40; ++iy) {
    for (int ix = 0; ix < 40; ++ix) EXPECT_NEAR(part.at(ix, iy), whole.at(50 + ix, 30 + iy), 1e-9);
  }
}

TEST(WheelTracks, ChangeInSteps) {
  const Route route = straight_route(60.0);
  WheelTracks tracks(route, 1.0);
  tracks.set_driven(0.0);
  EXPECT_EQ(tracks.revision(), 0U);
  tracks.set_driven(20.0);
  const auto revision = tracks.revision();
  tracks.set_driven(20.5);
  EXPECT_EQ(tracks.revision(), revision);
  tracks.set_driven(26.0);
  EXPECT_NE(tracks.revision(), revision);
}

struct RockyPlace {
  RockyPlace() : terrain(options(), 1, plane_raster(0.0, {0.0, 0.0})), route(straight_route(50.0)) {}
  static TerrainOptions options() {
    TerrainOptions options = smooth_ground();
    options.rock_abundance = 0.1;
    return options;
  }
  Terrain terrain;
  Route route;
};

TEST(Fillets, BankSoilUpAgainstRocksOffTheRoute) {
  const RockyPlace place;
  const Fillets fillets(place.terrain.rocks(), place.route);
  Patch soil(0.0, -10.0, 0.05, 400, 400);
  fillets.add_to(soil);
  int banked = 0;
  for (const RockPlace& rock : place.terrain.rocks().within({1.0, -9.0}, {19.0, 9.0}, 0.3)) {
    if (place.terrain.rocks().blocks(rock, place.route)) continue;
    const int ix = static_cast<int>(std::lround(rock.p_m.x() / 0.05)),
              iy = static_cast<int>(std::lround((rock.p_m.y() + 10.0) / 0.05));
    EXPECT_GT(soil.at(ix, iy), 0.08 * rock.diameter_m);
    ++banked;
  }
  EXPECT_GT(banked, 20);
  for (const double value : soil.values) EXPECT_GE(value, 0.0);
}

TEST(Terrain, ShowsItsLayersWithoutMovingTheGround) {
  RockyPlace place;
  const double before = place.terrain.height(3.0, 0.5);
  auto tracks = std::make_shared<WheelTracks>(place.route, 1.0);
  place.terrain.add_layer(tracks);
  tracks->set_driven(40.0);
  EXPECT_NEAR(place.terrain.height(3.0, 0.5) - before, -0.018, 0.004);
  EXPECT_EQ(place.terrain.ground_height(3.0, 0.5), before);
}

TEST(RockPopulation, LiesDenserAroundFreshCraters) {
  const std::vector<Crater> one{aged_crater(0.0, 0.0, 10.0, 0.0)};
  EXPECT_NEAR(ejecta_density(one, {5.0, 0.0}), 12.0, 1e-9);
  EXPECT_GT(ejecta_density(one, {10.0, 0.0}), 2.0);
  EXPECT_NEAR(ejecta_density(one, {21.0, 0.0}), 1.0, 1e-9);
  TerrainOptions options;
  options.rock_abundance = 0.02;
  const CraterField fresh{3, 0.02, 8.0, 16.0, 0.0, 0.2};
  const RockPopulation rocks(options, 4, fresh);
  double near = 0.0, near_area = 0.0, all = 0.0;
  const double side = 400.0;
  for (const RockPlace& rock : rocks.within({0.0, 0.0}, {side, side}, 0.3)) {
    all += 1.0;
    for (const Crater& crater : fresh.within(0.0, 0.0, side, side, 0.0)) {
      near += std::hypot(rock.p_m.x() - crater.x_m, rock.p_m.y() - crater.y_m) < crater.diameter_m ? 1.0 : 0.0;
    }
  }
  for (const Crater& crater : fresh.within(0.0, 0.0, side, side, 0.0))
    near_area += std::numbers::pi * std::pow(crater.diameter_m, 2);
  ASSERT_GT(near_area, 0.0);
  EXPECT_GT(near / near_area, 4.0 * all / (side * side));
}

}  // namespace
}  // namespace demslam
