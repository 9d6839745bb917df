#include "demslam/sim/renderer.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "demslam/sim/clipmap.h"
#include "demslam/sim/illumination.h"
#include "demslam/sim/lens.h"
#include "demslam/sim/ray_scene.h"

namespace demslam {
namespace {

using Eigen::Vector3f;

constexpr double kRangeM = 4000.0;    // terrain is there up to this distance
constexpr double kRockReach = 200.0;  // rocks are there up to this many of their diameters, at 512 px focal length
constexpr float kNear = 0.05F;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Grid cells per side that give two to four pixels per cell.
int clipmap_cells(const CameraOptions& camera) {
  const double focal = 0.5 * camera.width_px / std::tan(camera.horizontal_fov_deg * std::numbers::pi / 360.0);
  return std::clamp(static_cast<int>(std::lround(focal / 128.0)), 1, 16) * 128;
}

/// The rays of a small block of pixels, and what they met.
struct Packet {
  int u, v;  ///< the block's first pixel
  alignas(32) int valid[kPacket];
  alignas(32) RTCRayHit8 rays;
};

void intersect(RTCScene scene, Packet& packet) {
  for (int i = 0; i < kPacket; ++i) {
    packet.rays.hit.geomID[i] = packet.rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcIntersect8(packet.valid, scene, &packet.rays, &arguments);
  for (int i = 0; i < kPacket; ++i) {
    if (packet.rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) packet.valid[i] = 0;
  }
}

bool is_rock(const RTCHit8& hit, int i) { return hit.instID[0][i] == RayScene::kRocks; }

/// Where the rays of one pass go through their pixels, and what the pass is for.
struct Pass {
  double du = 0.0, dv = 0.0;  ///< from the pixel's centre
  float weight = 1.0F;        ///< of this pass in the pixel's mean radiance; 0: geometry only
  bool is_centre = true;      ///< defines depth and surface
};

std::vector<Pass> passes_of(int per_axis) {
  std::vector<Pass> passes;
  if (per_axis % 2 == 0) passes.push_back({0.0, 0.0, 0.0F, true});
  const int count = per_axis * per_axis;
  for (int k = 0; k < count; ++k) {
    passes.push_back({(k % per_axis + 0.5) / per_axis - 0.5, (k / per_axis + 0.5) / per_axis - 0.5,
                      1.0F / static_cast<float>(count), 2 * k + 1 == count});
  }
  return passes;
}

/// What all rays of one rendering have in common.
struct View {
  const Camera& camera;
  Eigen::Matrix3d R_scene_camera;
  Vector3f origin;
  Rendering& out;
};

}  // namespace

struct Renderer::World {
  World(const SceneOptions& scene, const Terrain& terrain_in, const Route& route)
      : terrain(terrain_in),
        clipmap(terrain, clipmap_cells(scene.camera), kRangeM),
        field(scene.terrain, scene.seed, terrain, route),
        rays(field.shapes()),
        illumination(scene.light),
        passes(passes_of(scene.camera.samples_per_axis)) {}

  Vector3f relative(const Eigen::Vector3d& p_map) const { return (p_map - clipmap.origin()).cast<float>(); }
  void trace_block(const View& view, const Pass& pass, int u, int v) const;
  void store(const View& view, const Pass& pass, const Packet& packet, const Hit* hits) const;
  Hit hit_of(const RTCRayHit8& packet, int i, float pixel_angle) const;
  void shade_ground(int level, float footprint, Hit& hit) const;
  void shade_rock(const Rock& rock, unsigned triangle, float u, float v, float footprint, Hit& hit) const;

  const Terrain& terrain;
  Clipmap clipmap;
  RockField field;
  std::vector<Rock> placed, rocks;
  RayScene rays;
  Illumination illumination;
  std::vector<Pass> passes;
  Eigen::Vector3d lamp = Eigen::Vector3d::Zero();
  bool stale = true;
};

Renderer::Renderer(const SceneOptions& scene, const Terrain& terrain, const Route& route)
    : world_(std::make_unique<World>(scene, terrain, route)) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;

void Renderer::place(const Rock& rock) {
  world_->placed.push_back(rock);
  world_->stale = true;
}

void Renderer::set_lamp(const Eigen::Vector3d& p_map) { world_->lamp = p_map; }

void Renderer::centre_on(const Eigen::Vector2d& position) {
  World& world = *world_;
  if (!world.clipmap.centre_on(position) && !world.stale) return;
  world.rocks = world.field.around(world.clipmap.centre(), kRockReach * world.clipmap.cells() / 512.0);
  world.rocks.insert(world.rocks.end(), world.placed.begin(), world.placed.end());
  world.rays.build(world.clipmap, world.rocks);
  world.stale = false;
}

Rendering Renderer::render(const Camera& camera, const Pose& T_map_camera) const {
  const std::size_t pixels = static_cast<std::size_t>(camera.width) * camera.height;
  Rendering out{camera.width, camera.height, std::vector<float>(pixels, 0.0F), std::vector<float>(pixels, kInfinity),
                std::vector<Surface>(pixels, Surface::sky)};
  const View view{camera, T_map_camera.rotation_matrix(), world_->relative(T_map_camera.translation()), out};
  tbb::parallel_for(0, (camera.height + kDown - 1) / kDown, [&](int strip) {
    for (int u = 0; u < camera.width; u += kAcross) {
      for (const Pass& pass : world_->passes) world_->trace_block(view, pass, u, strip * kDown);
    }
  });
  return out;
}

std::vector<RangeReturn> Renderer::cast(const Pose& T_map_sensor, std::span<const Eigen::Vector3d> directions) const {
  std::vector<RangeReturn> returns(directions.size(), {kInfinity, Surface::sky});
  const Vector3f origin = world_->relative(T_map_sensor.translation());
  const std::size_t packets = (directions.size() + kPacket - 1) / kPacket;
  tbb::parallel_for(std::size_t{0}, packets, [&](std::size_t p) {
    Packet packet{};
    for (std::size_t i = 0; i < kPacket && p * kPacket + i < directions.size(); ++i) {
      const Eigen::Vector3d direction = T_map_sensor.rotation() * directions[p * kPacket + i];
      packet.valid[i] = -1;
      set_ray(packet.rays.ray, static_cast<int>(i), origin, direction.cast<float>(), kNear, kInfinity);
    }
    intersect(world_->rays.handle(), packet);
    for (int i = 0; i < kPacket; ++i) {
      if (packet.valid[i] == 0) continue;
      returns[p * kPacket + i] = {packet.rays.ray.tfar[i],
                                  is_rock(packet.rays.hit, i) ? Surface::rock : Surface::ground};
    }
  });
  return returns;
}

void Renderer::World::trace_block(const View& view, const Pass& pass, int u, int v) const {
  Packet packet{.u = u, .v = v};
  for (int i = 0; i < kPacket; ++i) {
    const int column = u + i % kAcross, row = v + i / kAcross;
    packet.valid[i] = column < view.camera.width && row < view.camera.height ? -1 : 0;
    const Eigen::Vector3d ray = ray_of(view.camera, column + pass.du, row + pass.dv);
    set_ray(packet.rays.ray, i, view.origin, (view.R_scene_camera * ray).cast<float>(), kNear, kInfinity);
  }
  intersect(rays.handle(), packet);
  Hit hits[kPacket];
  for (int i = 0; i < kPacket; ++i) {
    if (packet.valid[i] != 0) hits[i] = hit_of(packet.rays, i, static_cast<float>(1.0 / view.camera.fx));
  }
  store(view, pass, packet, hits);
}

void Renderer::World::store(const View& view, const Pass& pass, const Packet& packet, const Hit* hits) const {
  float radiance[kPacket] = {};
  if (pass.weight > 0.0F) {
    const std::uint64_t key =
        (static_cast<std::uint64_t>(packet.v) << 32) + static_cast<std::uint64_t>(packet.u) * kPacket;
    illumination.light(rays.handle(), packet.valid, hits, key, relative(lamp), radiance);
  }
  for (int i = 0; i < kPacket; ++i) {
    if (packet.valid[i] == 0) continue;
    const std::size_t pixel =
        static_cast<std::size_t>(packet.v + i / kAcross) * view.camera.width + packet.u + i % kAcross;
    view.out.radiance[pixel] += pass.weight * radiance[i];
    if (!pass.is_centre) continue;
    view.out.depth_m[pixel] = packet.rays.ray.tfar[i];  // the ray's direction has camera z = 1
    view.out.surface[pixel] = hits[i].surface;
  }
}

Hit Renderer::World::hit_of(const RTCRayHit8& packet, int i, float pixel_angle) const {
  const RTCRay8& ray = packet.ray;
  const Vector3f direction(ray.dir_x[i], ray.dir_y[i], ray.dir_z[i]);
  Hit hit;
  hit.position = Vector3f(ray.org_x[i], ray.org_y[i], ray.org_z[i]) + ray.tfar[i] * direction;
  hit.to_eye = -direction.normalized();
  hit.offset = 1e-3F + 1e-4F * ray.tfar[i];
  const float footprint = pixel_angle * ray.tfar[i];
  if (is_rock(packet.hit, i)) {
    const Rock& rock = rocks[packet.hit.instPrimID[0][i]];
    shade_rock(rock, packet.hit.primID[i], packet.hit.u[i], packet.hit.v[i], footprint, hit);
  } else {
    const Vector3f facet = Vector3f(packet.hit.Ng_x[i], packet.hit.Ng_y[i], packet.hit.Ng_z[i]).normalized();
    const float foreshortening = std::sqrt(std::max(std::abs(facet.dot(hit.to_eye)), 0.05F));
    shade_ground(static_cast<int>(packet.hit.geomID[i]), footprint / foreshortening, hit);
  }
  return hit;
}

void Renderer::World::shade_ground(int level, float footprint, Hit& hit) const {
  const Clipmap::Shade shade = clipmap.shade(level, hit.position.x(), hit.position.y());
  const Eigen::Vector2d place = clipmap.origin().head<2>() + hit.position.head<2>().cast<double>();
  const FieldSample micro = terrain.micro_relief(place.x(), place.y(), clipmap.levels()[level].step_m, footprint);
  const Eigen::Vector2f slope = Eigen::Vector2d(shade.slope_x + micro.dx, shade.slope_y + micro.dy).cast<float>();
  hit.normal = Vector3f(-slope.x(), -slope.y(), 1.0F).normalized();
  hit.albedo = shade.albedo;
}

void Renderer::World::shade_rock(const Rock& rock, unsigned triangle, float u, float v, float footprint,
                                 Hit& hit) const {
  const RockShape& shape = field.shapes()[rock.shape];
  const auto& [a, b, c] = shape.triangles[triangle];
  const Vector3f smooth = (1.0F - u - v) * shape.normals[a] + u * shape.normals[b] + v * shape.normals[c];
  hit.normal = (rock.R_map_rock * smooth).normalized();
  hit.surface = Surface::rock;
  hit.albedo = rock.albedo;
  if (rock.shape == 0) return;  // spheres stay as smooth as their closed form
  const Vector3f local = rock.R_map_rock.conjugate() * (hit.position - relative(rock.p_map));
  const FieldSample grain =
      terrain.micro_relief(local.x() + 0.7 * local.z(), local.y() - 0.6 * local.z(), 0.04, footprint);
  hit.normal = (hit.normal + 0.7F * Eigen::Vector3d(grain.dx, grain.dy, 0.0).cast<float>()).normalized();
}

}  // namespace demslam
