#include "demslam/sim/renderer.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

#include "demslam/sim/clipmap.h"
#include "demslam/sim/illumination.h"
#include "demslam/sim/lens.h"
#include "demslam/sim/ray_scene.h"

namespace demslam {
namespace {

using Eigen::Vector3f;

constexpr double kRangeM = 30000.0;   // terrain is there up to this distance
constexpr double kRockReach = 200.0;  // rocks are there up to this many of their diameters, at 512 px focal length
constexpr float kNear = 0.05F;
constexpr int kMoments = 5;  // of an exposure, with one ray per pixel
// Shadows start this far off the surface: nearly the same from near and far, or their edges would wander as the rover
// approaches, by eleven times the difference under a sun 5 degrees high.
constexpr float kShadowOffset = 1e-3F, kRounding = 2e-6F;
constexpr float kEdgeContrast = 0.25F, kDarkest = 0.1F;  // of an edge: to the brighter pixel, and to the image's mean
constexpr float kRockTextureStep = 0.04F, kRockGrain = 0.7F;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Grid cells per side that give two to four pixels per cell.
int clipmap_cells(const CameraOptions& camera) {
  const double focal = 0.5 * camera.width_px / std::tan(camera.horizontal_fov_deg * std::numbers::pi / 360.0);
  return std::clamp(static_cast<int>(std::lround(focal / 128.0)), 1, 16) * 128;
}

/// Sixteen rays, each through a pixel in some pass, and what they met.
struct Packet {
  std::uint64_t key = 0;  ///< of what is random about it
  int u[kPacket], v[kPacket];
  std::size_t pass[kPacket];
  alignas(64) int valid[kPacket];
  alignas(64) RTCRayHit16 rays;
};

void intersect(RTCScene scene, Packet& packet) {
  for (int i = 0; i < kPacket; ++i) {
    packet.rays.hit.geomID[i] = packet.rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcIntersect16(packet.valid, scene, &packet.rays, &arguments);
  for (int i = 0; i < kPacket; ++i) {
    if (packet.rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) packet.valid[i] = 0;
  }
}

bool is_rock(const RTCHit16& hit, int i) { return hit.instID[0][i] == RayScene::kRocks; }

/// Where the rays of one pass go through their pixels, and what the pass is for.
struct Pass {
  double du = 0.0, dv = 0.0;  ///< from the pixel's centre
  double time = 0.0;          ///< from mid-exposure, in exposure times
  float weight = 1.0F;        ///< of this pass in the pixel's mean radiance; 0: geometry only
  bool is_centre = true;      ///< defines depth, surface and normal
};

/// The further rays of a pixel on an edge: a square turned by atan(1/2), which has four rows and four columns.
constexpr int kEdgeRays = 4;
std::vector<Pass> edge_passes() {
  std::vector<Pass> passes;
  for (const auto& [du, dv] : {std::pair{-0.125, -0.375}, {0.375, -0.125}, {0.125, 0.375}, {-0.375, 0.125}}) {
    passes.push_back({.du = du, .dv = dv, .is_centre = false});
  }
  return passes;
}

/// n x n rays per pixel, spread over the exposure in another order than over the pixel; the centre at mid-exposure.
std::vector<Pass> passes_of(int per_axis) {
  std::vector<Pass> passes;
  if (per_axis % 2 == 0) passes.push_back({.weight = 0.0F});
  const int count = per_axis * per_axis, middle = count / 2, stride = per_axis + 1;
  for (int k = 0; k < count; ++k) {
    const int moment = (((k - middle) * stride + middle) % count + count) % count;  // a permutation: stride is coprime
    const int column = k % per_axis, row = k / per_axis;
    passes.push_back({(column + 0.5) / per_axis - 0.5, (row + 0.5) / per_axis - 0.5, (moment + 0.5) / count - 0.5,
                      1.0F / static_cast<float>(count), 2 * k + 1 == count});
  }
  return passes;
}

/// The same rays at several moments of the exposure, where there is one ray per pixel only.
std::vector<Pass> moments_of(int count) {
  std::vector<Pass> passes;
  passes.reserve(count);
  for (int k = 0; k < count; ++k) {
    passes.push_back(
        {.time = (k + 0.5) / count - 0.5, .weight = 1.0F / static_cast<float>(count), .is_centre = 2 * k + 1 == count});
  }
  return passes;
}

/// The camera as the scene sees it at one moment.
struct Stand {
  Eigen::Matrix3d R_scene_camera;
  Vector3f origin;
};

bool same(const Camera& a, const Camera& b) {
  return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy && a.cx == b.cx && a.cy == b.cy &&
         a.distortion == b.distortion && a.coefficients == b.coefficients;
}

/// The rays (x, y, 1) of a lens that is slow to invert, kept from image to image.
struct LensTable {
  Camera camera;
  std::vector<std::vector<Eigen::Vector2f>> passes;  ///< (x, y) of every pixel

  LensTable(const Camera& lens, const std::vector<Pass>& all) : camera(lens), passes(all.size()) {
    for (std::size_t p = 0; p < all.size(); ++p) {
      passes[p].resize(static_cast<std::size_t>(camera.width) * camera.height);
      tbb::parallel_for(0, camera.height, [&](int v) {
        for (int u = 0; u < camera.width; ++u) {
          passes[p][static_cast<std::size_t>(v) * camera.width + u] =
              ray_of(camera, u + all[p].du, v + all[p].dv).head<2>().cast<float>();
        }
      });
    }
  }
};

/// What all rays of one rendering have in common.
struct View {
  const Camera& camera;
  const LensTable* lens;      ///< null: the lens is quick
  std::vector<Stand> stands;  ///< for each pass: one, or one for each row
  int stands_per_pass;
  Rendering& out;

  const Stand& stand(std::size_t pass, int row) const {
    return stands[pass * stands_per_pass + (stands_per_pass > 1 ? std::min(row, stands_per_pass - 1) : 0)];
  }
};

/// Where the points of a packet find their texture, and how fine it may be.
struct alignas(64) Texture {
  double x[kPacket], y[kPacket];             ///< metres, on the map or on the rock
  float step[kPacket], shortest[kPacket];    ///< of Terrain::micro_relief()
  float slope_x[kPacket], slope_y[kPacket];  ///< of the surface without the texture
};

/// Pixels that differ from a neighbour in brightness: one ray is not their mean.
std::vector<std::size_t> edge_pixels(const Rendering& image) {
  const std::vector<float>& radiance = image.radiance;
  const double sum = std::accumulate(radiance.begin(), radiance.end(), 0.0);
  const float floor = kDarkest * static_cast<float>(sum / static_cast<double>(radiance.size()));
  const auto width = static_cast<std::size_t>(image.width);
  std::vector<bool> is_edge(radiance.size(), false);
  const auto compare = [&](std::size_t a, std::size_t b) {
    const float least = kEdgeContrast * (std::max(radiance[a], radiance[b]) + floor);
    if (std::abs(radiance[a] - radiance[b]) > least) is_edge[a] = is_edge[b] = true;
  };
  for (std::size_t i = 0; i < radiance.size(); ++i) {
    if (i % width != 0) compare(i - 1, i);
    if (i >= width) compare(i - width, i);
  }
  std::vector<std::size_t> edges;
  for (std::size_t i = 0; i < radiance.size(); ++i) {
    if (is_edge[i]) edges.push_back(i);
  }
  return edges;
}

}  // namespace

struct Renderer::World {
  World(const SceneOptions& scene, const Terrain& terrain_in, const Route& route)
      : terrain(terrain_in),
        clipmap(terrain, clipmap_cells(scene.camera), kRangeM),
        field(terrain, route),
        rays(field.shapes()),
        illumination(scene.light),
        passes(passes_of(scene.camera.samples_per_axis)),
        whole_image(passes.size()) {
    if (whole_image > 1) return;
    if (scene.camera.exposure_time_s > 0.0) {
      passes = moments_of(kMoments);
      whole_image = passes.size();
    } else if (scene.camera.smooth_edges) {
      const std::vector<Pass> further = edge_passes();
      passes.insert(passes.end(), further.begin(), further.end());
    }
  }

  Vector3f relative(const Eigen::Vector3d& p_map) const { return (p_map - clipmap.origin()).cast<float>(); }
  View view_of(const Camera& camera, const Pose& T_map_camera, const Shutter& shutter, Rendering& out) const;
  const LensTable* table_of(const Camera& camera) const;
  Eigen::Vector3d camera_ray(const View& view, std::size_t pass, int u, int v) const;
  void trace_block(const View& view, std::size_t pass, int u, int v) const;
  void trace_edges(const View& view, const std::vector<std::size_t>& pixels, std::size_t first) const;
  void trace(const View& view, Packet& packet, float* radiance) const;
  Hits hits_of(const Packet& packet, float pixel_angle) const;
  void shade_ground(const RTCRayHit16& rays, int i, Texture& texture, Hits& hits) const;
  void shade_rock(const RTCHit16& hit, int i, Texture& texture, Hits& hits) const;
  void add_texture(const Packet& packet, const Texture& texture, Hits& hits) const;

  const Terrain& terrain;
  Clipmap clipmap;
  RockField field;
  std::vector<Rock> placed, rocks;
  RayScene rays;
  Illumination illumination;
  std::vector<Pass> passes;
  std::size_t whole_image;               ///< so many of the passes go over all pixels, the others over edges
  mutable std::deque<LensTable> lenses;  ///< of the cameras seen last: the rig's, and its light meter's
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
  world.illumination.look_around(world.clipmap, world.rays.handle());
  world.stale = false;
}

Rendering Renderer::render(const Camera& camera, const Pose& T_map_camera, const Shutter& shutter, bool normals) const {
  const std::size_t pixels = static_cast<std::size_t>(camera.width) * camera.height;
  Rendering out{camera.width,
                camera.height,
                std::vector<float>(pixels, 0.0F),
                std::vector<float>(pixels, kInfinity),
                std::vector<Surface>(pixels, Surface::sky),
                {}};
  if (normals) out.normal.assign(pixels, Vector3f::Zero());
  const View view = world_->view_of(camera, T_map_camera, shutter, out);
  tbb::parallel_for(0, (camera.height + kDown - 1) / kDown, [&](int strip) {
    for (int u = 0; u < camera.width; u += kAcross) {
      for (std::size_t pass = 0; pass < world_->whole_image; ++pass) {
        world_->trace_block(view, pass, u, strip * kDown);
      }
    }
  });
  if (world_->whole_image == world_->passes.size()) return out;
  const std::vector<std::size_t> edges = edge_pixels(out);
  constexpr std::size_t kTogether = kPacket / kEdgeRays;
  tbb::parallel_for(std::size_t{0}, (edges.size() + kTogether - 1) / kTogether,
                    [&](std::size_t group) { world_->trace_edges(view, edges, group * kTogether); });
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

View Renderer::World::view_of(const Camera& camera, const Pose& T_map_camera, const Shutter& shutter,
                              Rendering& out) const {
  View view{camera, table_of(camera), {}, shutter.readout_s > 0.0 ? camera.height : 1, out};
  for (const Pass& pass : passes) {
    for (int row = 0; row < view.stands_per_pass; ++row) {
      const double part = view.stands_per_pass > 1 ? row / (camera.height - 1.0) - 0.5 : 0.0;
      const double time_s = pass.time * shutter.exposure_s + part * shutter.readout_s;
      const Pose T = time_s == 0.0 ? T_map_camera : T_map_camera * Pose::exp(time_s * shutter.twist);
      view.stands.push_back({T.rotation_matrix(), relative(T.translation())});
    }
  }
  return view;
}

const LensTable* Renderer::World::table_of(const Camera& camera) const {
  constexpr std::size_t kKept = 2;
  if (camera.distortion == Distortion::none) return nullptr;
  for (const LensTable& table : lenses) {
    if (same(table.camera, camera)) return &table;
  }
  if (lenses.size() == kKept) lenses.pop_front();
  return &lenses.emplace_back(camera, passes);
}

Eigen::Vector3d Renderer::World::camera_ray(const View& view, std::size_t pass, int u, int v) const {
  if (view.lens == nullptr) return ray_of(view.camera, u + passes[pass].du, v + passes[pass].dv);
  const Eigen::Vector2f& xy = view.lens->passes[pass][static_cast<std::size_t>(v) * view.camera.width + u];
  return {xy.x(), xy.y(), 1.0};
}

/// One pass over a block of pixels.
void Renderer::World::trace_block(const View& view, std::size_t pass, int u, int v) const {
  Packet packet{.key = (static_cast<std::uint64_t>(v) << 32) + static_cast<std::uint64_t>(u) * kPacket};
  for (int i = 0; i < kPacket; ++i) {
    packet.u[i] = u + i % kAcross;
    packet.v[i] = v + i / kAcross;
    packet.pass[i] = pass;
    packet.valid[i] = packet.u[i] < view.camera.width && packet.v[i] < view.camera.height ? -1 : 0;
  }
  float radiance[kPacket] = {};
  trace(view, packet, radiance);
  Rendering& out = view.out;
  for (int i = 0; i < kPacket; ++i) {
    if (packet.valid[i] != 0) {
      out.radiance[static_cast<std::size_t>(packet.v[i]) * out.width + packet.u[i]] +=
          passes[pass].weight * radiance[i];
    }
  }
}

/// The further rays of a few of the pixels on edges, together with the one they have.
void Renderer::World::trace_edges(const View& view, const std::vector<std::size_t>& pixels, std::size_t first) const {
  Rendering& out = view.out;
  const auto width = static_cast<std::size_t>(out.width);
  Packet packet{.key = (std::uint64_t{1} << 63) + pixels[first] * kPacket};
  for (int i = 0; i < kPacket; ++i) {
    const std::size_t k = first + i / kEdgeRays;
    const std::size_t pixel = pixels[std::min(k, pixels.size() - 1)];
    packet.u[i] = static_cast<int>(pixel % width);
    packet.v[i] = static_cast<int>(pixel / width);
    packet.pass[i] = whole_image + i % kEdgeRays;
    packet.valid[i] = k < pixels.size() ? -1 : 0;
  }
  float radiance[kPacket] = {};
  trace(view, packet, radiance);
  for (int i = 0; i < kPacket && first + i / kEdgeRays < pixels.size(); i += kEdgeRays) {
    float& mean = out.radiance[pixels[first + i / kEdgeRays]];
    mean = std::accumulate(radiance + i, radiance + i + kEdgeRays, mean) / (1.0F + kEdgeRays);
  }
}

/// Casts the rays of the valid lanes; those that meet nothing become invalid. The pass through the pixels' centres
/// leaves depth, surface and normal.
void Renderer::World::trace(const View& view, Packet& packet, float* radiance) const {
  for (int i = 0; i < kPacket; ++i) {
    const bool valid = packet.valid[i] != 0;
    const Eigen::Vector3d ray =
        valid ? camera_ray(view, packet.pass[i], packet.u[i], packet.v[i]) : Eigen::Vector3d(0.0, 0.0, 1.0);
    if (std::isnan(ray.x())) packet.valid[i] = 0;  // outside a fisheye's image circle
    const Stand& stand = view.stand(packet.pass[i], packet.v[i]);
    set_ray(packet.rays.ray, i, stand.origin, (stand.R_scene_camera * ray).cast<float>(), kNear, kInfinity);
  }
  intersect(rays.handle(), packet);
  if (std::all_of(packet.valid, packet.valid + kPacket, [](int valid) { return valid == 0; })) return;
  const Hits hits = hits_of(packet, static_cast<float>(1.0 / view.camera.fx));
  if (passes[packet.pass[0]].weight > 0.0F) {
    illumination.light(rays.handle(), packet.valid, hits, packet.key, relative(lamp), radiance);
  }
  Rendering& out = view.out;
  for (int i = 0; i < kPacket; ++i) {
    if (packet.valid[i] == 0 || !passes[packet.pass[i]].is_centre) continue;
    const std::size_t pixel = static_cast<std::size_t>(packet.v[i]) * out.width + packet.u[i];
    out.depth_m[pixel] = packet.rays.ray.tfar[i];  // the ray's direction has camera z = 1
    out.surface[pixel] = hits.surface[i];
    if (!out.normal.empty()) out.normal[pixel] = Vector3f(hits.normal.x[i], hits.normal.y[i], hits.normal.z[i]);
  }
}

Hits Renderer::World::hits_of(const Packet& packet, float pixel_angle) const {
  const RTCRay16& ray = packet.rays.ray;
  Hits hits;
  Texture texture{};
  for (int i = 0; i < kPacket; ++i) {
    const float range = packet.valid[i] != 0 ? ray.tfar[i] : 1.0F;
    const float length =
        std::sqrt(ray.dir_x[i] * ray.dir_x[i] + ray.dir_y[i] * ray.dir_y[i] + ray.dir_z[i] * ray.dir_z[i]);
    hits.position.x[i] = ray.org_x[i] + range * ray.dir_x[i];
    hits.position.y[i] = ray.org_y[i] + range * ray.dir_y[i];
    hits.position.z[i] = ray.org_z[i] + range * ray.dir_z[i];
    hits.to_eye.x[i] = -ray.dir_x[i] / length;
    hits.to_eye.y[i] = -ray.dir_y[i] / length;
    hits.to_eye.z[i] = -ray.dir_z[i] / length;
    hits.offset[i] = kShadowOffset + kRounding * range;
    hits.footprint[i] = pixel_angle * range;
    texture.shortest[i] = 1e9F;
  }
  for (int i = 0; i < kPacket; ++i) {
    if (packet.valid[i] == 0) continue;
    if (is_rock(packet.rays.hit, i)) {
      shade_rock(packet.rays.hit, i, texture, hits);
    } else {
      shade_ground(packet.rays, i, texture, hits);
    }
  }
  add_texture(packet, texture, hits);
  return hits;
}

/// Slope and albedo of the grid, and where on the map the finer texture is.
void Renderer::World::shade_ground(const RTCRayHit16& rays_hit, int i, Texture& texture, Hits& hits) const {
  const int level = static_cast<int>(rays_hit.hit.geomID[i]);
  const Clipmap::Shade shade = clipmap.shade(level, hits.position.x[i], hits.position.y[i]);
  const Vector3f facet = Vector3f(rays_hit.hit.Ng_x[i], rays_hit.hit.Ng_y[i], rays_hit.hit.Ng_z[i]).normalized();
  const float cosine = std::abs(facet.dot(Vector3f(hits.to_eye.x[i], hits.to_eye.y[i], hits.to_eye.z[i])));
  hits.surface[i] = Surface::ground;
  hits.albedo[i] = shade.albedo;
  texture.slope_x[i] = shade.slope_x;
  texture.slope_y[i] = shade.slope_y;
  texture.x[i] = clipmap.origin().x() + hits.position.x[i];
  texture.y[i] = clipmap.origin().y() + hits.position.y[i];
  texture.step[i] = static_cast<float>(clipmap.levels()[level].step_m);
  texture.shortest[i] = hits.footprint[i] / std::sqrt(std::max(cosine, 0.05F));
}

/// The mesh's normal, and where on the rock the finer texture is.
void Renderer::World::shade_rock(const RTCHit16& hit, int i, Texture& texture, Hits& hits) const {
  const Rock& rock = rocks[hit.instPrimID[0][i]];
  const RockShape& shape = field.shapes()[rock.shape];
  const auto& [a, b, c] = shape.triangles[hit.primID[i]];
  const float u = hit.u[i], v = hit.v[i];
  const Vector3f smooth = (1.0F - u - v) * shape.normals[a] + u * shape.normals[b] + v * shape.normals[c];
  const Vector3f normal = (rock.R_map_rock * smooth).normalized();
  hits.normal.x[i] = normal.x();
  hits.normal.y[i] = normal.y();
  hits.normal.z[i] = normal.z();
  hits.surface[i] = Surface::rock;
  hits.albedo[i] = rock.albedo;
  if (rock.shape == 0) return;  // spheres stay as smooth as their closed form
  const Vector3f position(hits.position.x[i], hits.position.y[i], hits.position.z[i]);
  const Vector3f local = rock.R_map_rock.conjugate() * (position - relative(rock.p_map));
  texture.x[i] = local.x() + 0.7 * local.z();
  texture.y[i] = local.y() - 0.6 * local.z();
  texture.step[i] = kRockTextureStep;
  texture.shortest[i] = hits.footprint[i];
}

void Renderer::World::add_texture(const Packet& packet, const Texture& texture, Hits& hits) const {
  alignas(64) float slope_x[kPacket], slope_y[kPacket];
  terrain.micro_relief(texture.x, texture.y, texture.step, texture.shortest, slope_x, slope_y);
  for (int i = 0; i < kPacket; ++i) {
    if (packet.valid[i] == 0) continue;
    const bool ground = hits.surface[i] == Surface::ground;
    const float x = ground ? -(texture.slope_x[i] + slope_x[i]) : hits.normal.x[i] + kRockGrain * slope_x[i];
    const float y = ground ? -(texture.slope_y[i] + slope_y[i]) : hits.normal.y[i] + kRockGrain * slope_y[i];
    const float z = ground ? 1.0F : hits.normal.z[i];
    const float length = std::sqrt(x * x + y * y + z * z);
    hits.normal.x[i] = x / length;
    hits.normal.y[i] = y / length;
    hits.normal.z[i] = z / length;
  }
}

}  // namespace demslam
