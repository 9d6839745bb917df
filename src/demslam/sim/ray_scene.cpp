#include "demslam/sim/ray_scene.h"

#include <tbb/task_arena.h>

#include <algorithm>

#include "demslam/base/error.h"

namespace demslam {
namespace {

constexpr unsigned kNearLevels = 3;

/// Attaches a finished geometry and hands its ownership to the scene.
void attach(RTCScene scene, RTCGeometry geometry, unsigned id) {
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene, geometry, id);
  rtcReleaseGeometry(geometry);
}

void commit(RTCScene scene) {
  tbb::task_arena(1).execute([scene] { rtcCommitScene(scene); });
}

}  // namespace

RayScene::RayScene(const std::vector<RockShape>& shapes) : device_(rtcNewDevice(nullptr)) {
  if (!device_) throw Error("the ray caster (Embree) cannot start on this machine");
  for (const RockShape& shape : shapes) shapes_.push_back(shape_scene(shape));
}

RayScene::Scene RayScene::new_scene() const {
  Scene scene(rtcNewScene(device_.get()));
  rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);  // no ray slips between two cells
  return scene;
}

RayScene::Scene RayScene::shape_scene(const RockShape& shape) const {
  RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<Eigen::Vector3f*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Eigen::Vector3f), shape.vertices.size()));
  std::copy(shape.vertices.begin(), shape.vertices.end(), vertices);
  auto* triangles = static_cast<std::array<std::uint32_t, 3>*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(shape.triangles[0]), shape.triangles.size()));
  std::copy(shape.triangles.begin(), shape.triangles.end(), triangles);
  Scene scene = new_scene();
  attach(scene.get(), geometry, 0);
  commit(scene.get());
  return scene;
}

void RayScene::build(const Clipmap& clipmap, const std::vector<Rock>& rocks) {
  const auto levels = static_cast<unsigned>(clipmap.levels().size()), near = std::min(kNearLevels, levels);
  if (const std::uint64_t revision = clipmap.revision(near); !far_ || revision != far_revision_) {
    far_ = new_scene();
    for (unsigned k = near; k < levels; ++k) add_level(far_.get(), clipmap, k);
    commit(far_.get());
    far_revision_ = revision;
  }
  scene_ = new_scene();
  for (unsigned k = 0; k < near; ++k) add_level(scene_.get(), clipmap, k);
  add_far();
  if (!rocks.empty()) add_rocks(clipmap, rocks);
  commit(scene_.get());
  if (rtcGetDeviceError(device_.get()) != RTC_ERROR_NONE) throw Error("the ray caster (Embree) ran out of memory");
}

void RayScene::add_level(RTCScene scene, const Clipmap& clipmap, unsigned index) const {
  const Clipmap::Level& level = clipmap.levels()[index];
  const auto stride = static_cast<unsigned>(clipmap.cells()) + 1, cells = static_cast<unsigned>(clipmap.block());
  const auto nodes = static_cast<unsigned short>(cells + 1);
  RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_GRID);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, level.vertices.data(), 0,
                             sizeof(Clipmap::Vertex), level.vertices.size() - 1);
  auto* grids = static_cast<RTCGrid*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_GRID, 0, RTC_FORMAT_GRID,
                                                              sizeof(RTCGrid), level.blocks.size()));
  for (const Clipmap::Block& block : level.blocks) {
    *grids++ = {(static_cast<unsigned>(block.row) * stride + static_cast<unsigned>(block.col)) * cells, stride, nodes,
                nodes};
  }
  attach(scene, geometry, index);
}

void RayScene::add_far() {
  constexpr float kIdentity[12] = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};
  RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(geometry, far_.get());
  rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, kIdentity);
  attach(scene_.get(), geometry, kFar);
}

void RayScene::add_rocks(const Clipmap& clipmap, const std::vector<Rock>& rocks) {
  std::vector<RTCScene> scenes;
  for (const Scene& shape : shapes_) scenes.push_back(shape.get());
  RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_INSTANCE_ARRAY);
  rtcSetGeometryInstancedScenes(geometry, scenes.data(), scenes.size());
  auto* shape = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT,
                                                                    sizeof(std::uint32_t), rocks.size()));
  using Transform = Eigen::Matrix<float, 3, 4>;  // column-major, as the format says
  auto* transform = static_cast<Transform*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_TRANSFORM, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, sizeof(Transform), rocks.size()));
  for (const Rock& rock : rocks) {
    *shape++ = static_cast<std::uint32_t>(rock.shape);
    transform->leftCols<3>() = rock.diameter_m * rock.R_map_rock.toRotationMatrix();
    transform->col(3) = (rock.p_map - clipmap.origin()).cast<float>();
    ++transform;
  }
  attach(scene_.get(), geometry, kRocks);
}

}  // namespace demslam
