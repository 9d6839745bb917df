#include "demslam/sim/renderer.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "demslam/sim/clipmap.h"
#include "demslam/sim/photometry.h"
#include "demslam/sim/ray_scene.h"

namespace demslam {
namespace {

constexpr int kAcross = 4, kDown = 2, kPacket = kAcross * kDown;  // pixels that are cast together
constexpr double kRangeM = 4000.0;                                // terrain is there up to this distance
constexpr double kRockReach = 250.0;  // rocks are there up to this many of their diameters (at 512 px focal length)
constexpr float kNear = 0.05F;

using Eigen::Vector3f;

Vector3f sun_direction(const LightOptions& light) {
  const double elevation = light.sun_elevation_deg * std::numbers::pi / 180.0;
  const double azimuth = light.sun_azimuth_deg * std::numbers::pi / 180.0;
  return Eigen::Vector3d(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                         std::sin(elevation))
      .cast<float>();
}

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

void set_ray(RTCRay8& rays, int i, const Vector3f& origin, const Vector3f& direction, float near) {
  rays.org_x[i] = origin.x();
  rays.org_y[i] = origin.y();
  rays.org_z[i] = origin.z();
  rays.dir_x[i] = direction.x();
  rays.dir_y[i] = direction.y();
  rays.dir_z[i] = direction.z();
  rays.tnear[i] = near;
  rays.tfar[i] = std::numeric_limits<float>::infinity();
  rays.time[i] = 0.0F;
  rays.mask[i] = ~0U;
  rays.id[i] = 0;
  rays.flags[i] = 0;
}

/// A visible point ready to be lit.
struct Hit {
  Vector3f position, normal;  ///< relative to the clipmap's origin; shading normal
  Vector3f to_eye;            ///< unit
  float albedo = 1.0F;        ///< relative
  float offset = 1e-3F;       ///< shadow rays start this far off the surface
  Surface surface = Surface::ground;
};

}  // namespace

struct Renderer::World {
  World(const SceneOptions& scene, const Terrain& terrain_in, const Route& route)
      : terrain(terrain_in),
        clipmap(terrain, clipmap_cells(scene.camera), kRangeM),
        field(scene.terrain, scene.seed, terrain, route),
        rays(field.shapes()),
        sun(sun_direction(scene.light)),
        reflectance(scene.light.photometry, scene.light.albedo),
        passes(passes_of(scene.camera.samples_per_axis)) {}

  void trace_block(const View& view, const Pass& pass, int u, int v) const;
  void store(const View& view, const Pass& pass, const Packet& packet, const Hit* hits) const;
  Hit hit_of(const RTCRayHit8& rays, int i, float pixel_angle) const;
  void shade_ground(int level, float footprint, Hit& hit) const;
  void shade_rock(const Rock& rock, unsigned triangle, float u, float v, float footprint, Hit& hit) const;
  void light(const Packet& packet, const Hit* hits, float* radiance) const;

  const Terrain& terrain;
  Clipmap clipmap;
  RockField field;
  std::vector<Rock> placed, rocks;
  RayScene rays;
  Vector3f sun;
  Reflectance reflectance;
  std::vector<Pass> passes;
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
  Rendering out{camera.width, camera.height, std::vector<float>(pixels, 0.0F),
                std::vector<float>(pixels, std::numeric_limits<float>::infinity()),
                std::vector<Surface>(pixels, Surface::sky)};
  const View view{camera, T_map_camera.rotation_matrix(),
                  (T_map_camera.translation() - world_->clipmap.origin()).cast<float>(), out};
  tbb::parallel_for(0, (camera.height + kDown - 1) / kDown, [&](int strip) {
    for (int u = 0; u < camera.width; u += kAcross) {
      for (const Pass& pass : world_->passes) world_->trace_block(view, pass, u, strip * kDown);
    }
  });
  return out;
}

void Renderer::World::trace_block(const View& view, const Pass& pass, int u, int v) const {
  const Camera& camera = view.camera;
  Packet packet{.u = u, .v = v};
  for (int i = 0; i < kPacket; ++i) {
    const int column = u + i % kAcross, row = v + i / kAcross;
    packet.valid[i] = column < camera.width && row < camera.height ? -1 : 0;
    const Eigen::Vector3d ray((column + pass.du - camera.cx) / camera.fx, (row + pass.dv - camera.cy) / camera.fy, 1.0);
    set_ray(packet.rays.ray, i, view.origin, (view.R_scene_camera * ray).cast<float>(), kNear);
    packet.rays.hit.geomID[i] = packet.rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcIntersect8(packet.valid, rays.handle(), &packet.rays, &arguments);
  Hit hits[kPacket];
  for (int i = 0; i < kPacket; ++i) {
    if (packet.rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) packet.valid[i] = 0;
    if (packet.valid[i] != 0) hits[i] = hit_of(packet.rays, i, static_cast<float>(1.0 / camera.fx));
  }
  store(view, pass, packet, hits);
}

void Renderer::World::store(const View& view, const Pass& pass, const Packet& packet, const Hit* hits) const {
  float radiance[kPacket] = {};
  if (pass.weight > 0.0F) light(packet, hits, radiance);
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
  const Vector3f facet = Vector3f(packet.hit.Ng_x[i], packet.hit.Ng_y[i], packet.hit.Ng_z[i]).normalized();
  const unsigned instance = packet.hit.instID[0][i];
  const float footprint = pixel_angle * ray.tfar[i];
  if (instance == RTC_INVALID_GEOMETRY_ID) {
    const float foreshortening = std::sqrt(std::max(std::abs(facet.dot(hit.to_eye)), 0.05F));
    shade_ground(static_cast<int>(packet.hit.geomID[i]), footprint / foreshortening, hit);
  } else {
    shade_rock(rocks[packet.hit.instPrimID[0][i]], packet.hit.primID[i], packet.hit.u[i], packet.hit.v[i], footprint,
               hit);
  }
  return hit;
}

void Renderer::World::shade_ground(int level, float footprint, Hit& hit) const {
  const Clipmap::Shade shade = clipmap.shade(level, hit.position.x(), hit.position.y());
  const Eigen::Vector2d place = clipmap.origin().head<2>() + hit.position.head<2>().cast<double>();
  const FieldSample micro = terrain.micro_relief(place.x(), place.y(), clipmap.levels()[level].step_m, footprint);
  hit.normal =
      Vector3f(-shade.slope_x - static_cast<float>(micro.dx), -shade.slope_y - static_cast<float>(micro.dy), 1.0F)
          .normalized();
  hit.albedo = shade.albedo;
}

void Renderer::World::shade_rock(const Rock& rock, unsigned triangle, float u, float v, float footprint,
                                 Hit& hit) const {
  const RockShape& shape = field.shapes()[rock.shape];
  const auto& corner = shape.triangles[triangle];
  const Vector3f smooth =
      (1.0F - u - v) * shape.normals[corner[0]] + u * shape.normals[corner[1]] + v * shape.normals[corner[2]];
  hit.normal = (rock.R_map_rock * smooth).normalized();
  hit.surface = Surface::rock;
  hit.albedo = rock.albedo;
  if (rock.shape == 0) return;  // spheres stay as smooth as their closed form
  const Eigen::Vector3f local =
      rock.R_map_rock.conjugate() * (hit.position - (rock.p_map - clipmap.origin()).cast<float>());
  const FieldSample grain =
      terrain.micro_relief(local.x() + 0.7 * local.z(), local.y() - 0.6 * local.z(), 0.04, footprint);
  hit.normal =
      (hit.normal + 0.7F * Vector3f(static_cast<float>(grain.dx), static_cast<float>(grain.dy), 0.0F)).normalized();
}

/// Reflected sunlight of the valid hits; a shadow ray for each that faces the sun.
void Renderer::World::light(const Packet& packet, const Hit* hits, float* radiance) const {
  alignas(32) int valid[kPacket];
  alignas(32) RTCRay8 shadow;
  for (int i = 0; i < kPacket; ++i) {
    valid[i] = packet.valid[i] != 0 && hits[i].normal.dot(sun) > 0.0F ? -1 : 0;
    if (valid[i] != 0) set_ray(shadow, i, hits[i].position + hits[i].offset * hits[i].normal, sun, hits[i].offset);
  }
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcOccluded8(valid, rays.handle(), &shadow, &arguments);
  for (int i = 0; i < kPacket; ++i) {
    if (valid[i] == 0 || shadow.tfar[i] < 0.0F) continue;
    const Hit& hit = hits[i];
    radiance[i] = hit.albedo * reflectance(hit.normal.dot(sun), hit.normal.dot(hit.to_eye), hit.to_eye.dot(sun));
  }
}

}  // namespace demslam
