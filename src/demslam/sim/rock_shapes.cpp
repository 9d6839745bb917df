#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <numbers>

#include "demslam/base/random.h"
#include "demslam/sim/rocks.h"

namespace demslam {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

RockShape icosahedron() {
  const float g = 0.5F * (1.0F + std::sqrt(5.0F));
  RockShape shape;
  for (const float a : {-1.0F, 1.0F}) {
    for (const float b : {-g, g}) {
      shape.vertices.emplace_back(0.0F, a, b);
      shape.vertices.emplace_back(a, b, 0.0F);
      shape.vertices.emplace_back(b, 0.0F, a);
    }
  }
  // A face is three vertices that are all one edge length (2) apart.
  const auto touching = [&](std::uint32_t i, std::uint32_t j) {
    return std::abs((shape.vertices[i] - shape.vertices[j]).norm() - 2.0F) < 1e-3F;
  };
  for (std::uint32_t i = 0; i < 12; ++i) {
    for (std::uint32_t j = i + 1; j < 12; ++j) {
      for (std::uint32_t k = j + 1; k < 12; ++k) {
        if (!touching(i, j) || !touching(j, k) || !touching(i, k)) continue;
        const Eigen::Vector3f a = shape.vertices[i], b = shape.vertices[j], c = shape.vertices[k];
        const bool outward = (b - a).cross(c - a).dot(a + b + c) > 0.0F;
        shape.triangles.push_back(outward ? Triangle{i, j, k} : Triangle{i, k, j});
      }
    }
  }
  for (Eigen::Vector3f& vertex : shape.vertices) vertex.normalize();
  return shape;
}

/// Splits every triangle in four, new vertices on the unit sphere.
void subdivide(RockShape& shape) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto [at, added] = middles.emplace(std::minmax(a, b), static_cast<std::uint32_t>(shape.vertices.size()));
    if (added) shape.vertices.push_back((shape.vertices[a] + shape.vertices[b]).normalized());
    return at->second;
  };
  std::vector<Triangle> finer;
  for (const auto& [a, b, c] : shape.triangles) {
    const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
  }
  shape.triangles = std::move(finer);
}

void set_normals(RockShape& shape) {
  shape.normals.assign(shape.vertices.size(), Eigen::Vector3f::Zero());
  for (const Triangle& t : shape.triangles) {
    const Eigen::Vector3f& a = shape.vertices[t[0]];
    const Eigen::Vector3f area = (shape.vertices[t[1]] - a).cross(shape.vertices[t[2]] - a);
    for (const std::uint32_t i : t) shape.normals[i] += area;
  }
  for (Eigen::Vector3f& normal : shape.normals) normal.normalize();
}

Eigen::Vector3f random_direction(Random& random) {
  const double z = random.uniform(-1.0, 1.0), angle = 2.0 * std::numbers::pi * random.uniform();
  const double r = std::sqrt(1.0 - z * z);
  return {static_cast<float>(r * std::cos(angle)), static_cast<float>(r * std::sin(angle)), static_cast<float>(z)};
}

struct Plane {
  Eigen::Vector3f normal;
  float distance;
};

/// Radius of the cut sphere along a direction: a smooth minimum over the planes, so that edges are rounded.
float cut_radius(const std::vector<Plane>& planes, const Eigen::Vector3f& direction) {
  float sum = 1.0F;
  for (const Plane& plane : planes) {
    const float along = direction.dot(plane.normal);
    if (along > 0.0F) sum += std::pow(along / plane.distance, 24.0F);
  }
  return std::pow(sum, -1.0F / 24.0F);
}

/// A sum of plane waves with random directions: a cheap smooth field over the sphere.
struct Ripple {
  Eigen::Vector3f wave;
  float phase, amplitude;
};

std::vector<Ripple> ripples(Random& random) {
  std::vector<Ripple> result;
  for (int i = 0; i < 40; ++i) {
    const auto frequency = static_cast<float>(3.0 * std::pow(1.08, i));
    result.push_back({frequency * random_direction(random),
                      static_cast<float>(2.0 * std::numbers::pi * random.uniform()),
                      0.035F * std::pow(frequency / 3.0F, -0.9F)});
  }
  return result;
}

}  // namespace

RockShape sphere_shape(int subdivisions) {
  RockShape shape = icosahedron();
  for (int i = 0; i < subdivisions; ++i) subdivide(shape);
  shape.normals = shape.vertices;
  for (Eigen::Vector3f& vertex : shape.vertices) vertex *= 0.5F;
  return shape;
}

RockShape rock_shape(std::uint64_t seed, int subdivisions) {
  Random random(seed);
  std::vector<Plane> planes;
  for (int i = 0; i < 14; ++i)
    planes.push_back({random_direction(random), static_cast<float>(random.uniform(0.55, 0.95))});
  const std::vector<Ripple> rough = ripples(random);
  const Eigen::Vector3f squash(1.0F, static_cast<float>(random.uniform(0.65, 1.0)),
                               static_cast<float>(random.uniform(0.5, 0.85)));
  RockShape shape = sphere_shape(subdivisions);
  for (std::size_t i = 0; i < shape.vertices.size(); ++i) {
    const Eigen::Vector3f direction = shape.normals[i];
    float radius = cut_radius(planes, direction);
    for (const Ripple& ripple : rough) radius += ripple.amplitude * std::sin(ripple.wave.dot(direction) + ripple.phase);
    shape.vertices[i] = 0.5F * radius * direction.cwiseProduct(squash);
  }
  set_normals(shape);
  return shape;
}

}  // namespace demslam
