#include "demslam/sim/renderer.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <numbers>
#include <numeric>

#include "demslam/sim/clipmap.h"
#include "demslam/sim/illumination.h"
#include "demslam/sim/lens.h"
#include "demslam/sim/ray_passes.h"
#include "demslam/sim/ray_scene.h"
#include "demslam/sim/rough_pixels.h"

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
  std::vector<CentreHit>* centres = nullptr;  ///< of all pixels; null: not asked for

  float pixel_angle() const { return static_cast<float>(1.0 / camera.fx); }
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
      const std::vector<Pass> further = further_passes();
      passes.insert(passes.end(), further.begin(), further.end());
    }
  }

  Vector3f relative(const Eigen::Vector3d& p_map) const { return (p_map - clipmap.origin()).cast<float>(); }
  View view_of(const Camera& camera, const Pose& T_map_camera, const Shutter& shutter, Rendering& out) const;
  const LensTable* table_of(const Camera& camera) const;
  Eigen::Vector3d camera_ray(const View& view, std::size_t pass, int u, int v) const;
  void trace_block(const View& view, std::size_t pass, int u, int v) const;
  void smooth(const View& view) const;
  void smooth(const View& view, const RoughPixel* pixels, int count) const;
  void aim(const View& view, Packet& packet) const;
  void trace(const View& view, Packet& packet, float* radiance) const;
  void meet_planes(const View& view, Packet& packet) const;
  void keep_centres(const View& view, const Packet& packet, const Hits& hits, const Sunlight* sun) const;
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
  View view = world_->view_of(camera, T_map_camera, shutter, out);
  const bool smooth = world_->whole_image < world_->passes.size();
  std::vector<CentreHit> centres(smooth ? pixels : 0);
  if (smooth) view.centres = &centres;
  tbb::parallel_for(0, (camera.height + kDown - 1) / kDown, [&](int strip) {
    for (int u = 0; u < camera.width; u += kAcross) {
      for (std::size_t pass = 0; pass < world_->whole_image; ++pass) {
        world_->trace_block(view, pass, u, strip * kDown);
      }
    }
  });
  if (smooth) world_->smooth(view);
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

/// Further rays for the pixels whose mean one ray does not give; those of a kind together.
void Renderer::World::smooth(const View& view) const {
  std::vector<RoughPixel> rough = rough_pixels(view.out, *view.centres);
  if (!illumination.is_sun_only()) {
    for (RoughPixel& pixel : rough) pixel.kind = RoughPixel::Kind::traced;
  }
  constexpr std::size_t kTogether = kPacket / kFurtherRays;
  std::vector<std::size_t> starts;
  for (std::size_t i = 0; i < rough.size(); ++i) {
    if (starts.empty() || i == starts.back() + kTogether || rough[i].kind != rough[i - 1].kind) starts.push_back(i);
  }
  starts.push_back(rough.size());
  tbb::parallel_for(std::size_t{1}, starts.size(), [&](std::size_t k) {
    smooth(view, rough.data() + starts[k - 1], static_cast<int>(starts[k] - starts[k - 1]));
  });
}

/// The further rays of a few pixels of one kind, together with the one that they have.
void Renderer::World::smooth(const View& view, const RoughPixel* pixels, int count) const {
  Rendering& out = view.out;
  const auto width = static_cast<std::size_t>(out.width);
  Packet packet{.key = (std::uint64_t{1} << 63) + pixels->pixel * kPacket};
  for (int i = 0; i < kPacket; ++i) {
    const std::size_t pixel = pixels[std::min(i / kFurtherRays, count - 1)].pixel;
    packet.u[i] = static_cast<int>(pixel % width);
    packet.v[i] = static_cast<int>(pixel / width);
    packet.pass[i] = whole_image + i % kFurtherRays;
    packet.valid[i] = i < count * kFurtherRays ? -1 : 0;
  }
  aim(view, packet);
  float radiance[kPacket] = {};
  if (pixels->kind == RoughPixel::Kind::traced) {
    intersect(rays.handle(), packet);
    illumination.light_further(rays.handle(), packet.valid, hits_of(packet, view.pixel_angle()), packet.key,
                               relative(lamp), radiance);
  } else {
    meet_planes(view, packet);
    illumination.light_unbroken(packet.valid, hits_of(packet, view.pixel_angle()),
                                pixels->kind == RoughPixel::Kind::lit, radiance);
  }
  for (int k = 0; k < count; ++k) {
    float& mean = out.radiance[pixels[k].pixel];
    const float* of_pixel = radiance + static_cast<std::ptrdiff_t>(k) * kFurtherRays;
    mean = std::accumulate(of_pixel, of_pixel + kFurtherRays, mean) / static_cast<float>(1 + kFurtherRays);
  }
}

/// Points the rays of a packet.
void Renderer::World::aim(const View& view, Packet& packet) const {
  for (int i = 0; i < kPacket; ++i) {
    const bool valid = packet.valid[i] != 0;
    const Eigen::Vector3d ray =
        valid ? camera_ray(view, packet.pass[i], packet.u[i], packet.v[i]) : Eigen::Vector3d(0.0, 0.0, 1.0);
    if (std::isnan(ray.x())) packet.valid[i] = 0;  // outside a fisheye's image circle
    const Stand& stand = view.stand(packet.pass[i], packet.v[i]);
    set_ray(packet.rays.ray, i, stand.origin, (stand.R_scene_camera * ray).cast<float>(), kNear, kInfinity);
  }
}

/// Casts the rays of the valid lanes; those that meet nothing become invalid.
void Renderer::World::trace(const View& view, Packet& packet, float* radiance) const {
  aim(view, packet);
  intersect(rays.handle(), packet);
  if (std::all_of(packet.valid, packet.valid + kPacket, [](int valid) { return valid == 0; })) return;
  const Hits hits = hits_of(packet, view.pixel_angle());
  Sunlight sun[kPacket] = {};
  if (passes[packet.pass[0]].weight > 0.0F) {
    illumination.light(rays.handle(), packet.valid, hits, packet.key, relative(lamp), radiance, sun);
  }
  keep_centres(view, packet, hits, sun);
}

/// The rays of the valid lanes meet the ground in the plane around their pixel's centre.
void Renderer::World::meet_planes(const View& view, Packet& packet) const {
  for (int i = 0; i < kPacket; ++i) {
    if (packet.valid[i] == 0) continue;
    const std::size_t pixel = static_cast<std::size_t>(packet.v[i]) * view.out.width + packet.u[i];
    const Pass& pass = passes[packet.pass[i]];
    const CentreHit& centre = (*view.centres)[pixel];
    packet.rays.ray.tfar[i] = plane_depth(view.out, pixel, pass.du, pass.dv);
    packet.rays.hit.geomID[i] = centre.level;
    packet.rays.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    packet.rays.hit.Ng_x[i] = centre.facet.x();
    packet.rays.hit.Ng_y[i] = centre.facet.y();
    packet.rays.hit.Ng_z[i] = centre.facet.z();
  }
}

/// The pass through the pixels' centres leaves depth, surface and normal.
void Renderer::World::keep_centres(const View& view, const Packet& packet, const Hits& hits,
                                   const Sunlight* sun) const {
  Rendering& out = view.out;
  for (int i = 0; i < kPacket; ++i) {
    if (packet.valid[i] == 0 || !passes[packet.pass[i]].is_centre) continue;
    const std::size_t pixel = static_cast<std::size_t>(packet.v[i]) * out.width + packet.u[i];
    out.depth_m[pixel] = packet.rays.ray.tfar[i];  // the ray's direction has camera z = 1
    out.surface[pixel] = hits.surface[i];
    if (!out.normal.empty()) out.normal[pixel] = Vector3f(hits.normal.x[i], hits.normal.y[i], hits.normal.z[i]);
    if (view.centres == nullptr || hits.surface[i] != Surface::ground) continue;
    const RTCHit16& hit = packet.rays.hit;
    (*view.centres)[pixel] = {
        {hit.Ng_x[i], hit.Ng_y[i], hit.Ng_z[i]}, static_cast<std::uint8_t>(hit.geomID[i]), sun[i]};
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
