#include "demslam/sim/rough_pixels.h"

#include <gtest/gtest.h>

#include <cmath>

namespace demslam {
namespace {

using Kind = RoughPixel::Kind;

constexpr int kSize = 9;
constexpr std::size_t kMiddle = kSize * (kSize / 2) + kSize / 2;

/// Ground seen from above at a slant, striped so that every pixel differs from its neighbours.
struct Ground {
  Ground() : centres(static_cast<std::size_t>(kSize) * kSize, {{0.0F, 0.0F, 1.0F}, 0, Sunlight::lit}) {
    image.width = image.height = kSize;
    for (int v = 0; v < kSize; ++v) {
      for (int u = 0; u < kSize; ++u) {
        image.radiance.push_back((u + v) % 2 == 0 ? 0.1F : 0.2F);
        image.depth_m.push_back(static_cast<float>(depth(u, v)));
      }
    }
    image.surface.assign(image.radiance.size(), Surface::ground);
  }
  static double depth(double u, double v) { return 1.0 / (0.2 + 0.003 * u + 0.01 * v); }
  Kind kind_at(std::size_t pixel) const {
    for (const RoughPixel& rough : rough_pixels(image, centres)) {
      if (rough.pixel == pixel) return rough.kind;
    }
    ADD_FAILURE() << "not rough";
    return Kind::traced;
  }

  Rendering image;
  std::vector<CentreHit> centres;
};

TEST(RoughPixels, TextureOnUnbrokenGroundInOneLightNeedsNoRays) {
  Ground ground;
  EXPECT_EQ(ground.kind_at(kMiddle), Kind::lit);
  for (CentreHit& centre : ground.centres) centre.sun = Sunlight::shadowed;
  EXPECT_EQ(ground.kind_at(kMiddle), Kind::shadowed);
}

TEST(RoughPixels, EvenGroundIsNotRough) {
  Ground ground;
  ground.image.radiance.assign(ground.image.radiance.size(), 0.1F);
  EXPECT_TRUE(rough_pixels(ground.image, ground.centres).empty());
}

TEST(RoughPixels, SlopesTurnedAwayAmongLitOnesAreTexture) {
  Ground ground;
  ground.centres[kMiddle].sun = ground.centres[kMiddle + 1].sun = Sunlight::turned_away;
  EXPECT_EQ(ground.kind_at(kMiddle), Kind::lit);
}

TEST(RoughPixels, TheSunIsLookedForOnTheEdgeOfAShadow) {
  for (const Sunlight other : {Sunlight::shadowed, Sunlight::partly}) {
    Ground ground;
    ground.centres[kMiddle].sun = other;
    for (const std::size_t pixel : {kMiddle, kMiddle - 1, kMiddle + kSize}) {
      EXPECT_EQ(ground.kind_at(pixel), Kind::traced);
    }
    EXPECT_EQ(ground.kind_at(kMiddle + 2), Kind::lit);
  }
}

TEST(RoughPixels, OutlinesAndBendsAreTraced) {
  Ground step;
  step.image.depth_m[kMiddle] *= 0.95F;
  EXPECT_EQ(step.kind_at(kMiddle), Kind::traced);
  EXPECT_EQ(step.kind_at(kMiddle + 1), Kind::traced);
  Ground rock;
  rock.centres[kMiddle].level = CentreHit::kNoGround;
  EXPECT_EQ(rock.kind_at(kMiddle - kSize), Kind::traced);
  EXPECT_EQ(step.kind_at(kSize + 1), Kind::lit);
  EXPECT_EQ(step.kind_at(kSize), Kind::traced) << "on the image's border";
}

TEST(RoughPixels, PlaneDepthIsThatOfThePlane) {
  const Ground ground;
  for (const double offset : {-0.375, 0.0, 0.125}) {
    EXPECT_NEAR(plane_depth(ground.image, kMiddle, offset, -offset),
                Ground::depth(kSize / 2 + offset, kSize / 2 - offset), 1e-5);
  }
}

}  // namespace
}  // namespace demslam
