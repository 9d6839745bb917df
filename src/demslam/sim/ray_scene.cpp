#include "demslam/sim/ray_scene.h"

#include <tbb/task_arena.h>

#include <algorithm>

#include "demslam/base/error.h"

namespace demslam {
namespace {

/// Attaches a finished geometry and hands its ownership to the scene.
void attach(RTCScene scene, RTCGeometry geometry, unsigned id) {
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene, geometry, id);
  rtcReleaseGeometry(geometry);
}

}  // namespace

RayScene::RayScene(const std::vector<RockShape>& shapes) : device_(rtcNewDevice(nullptr)) {
  if (!device_) throw Error("the ray caster (Embree) cannot start on this machine");
  for (const RockShape& shape : shapes) shapes_.push_back(shape_scene(shape));
}

RayScene::Scene RayScene::shape_scene(const RockShape& shape) const {
  RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<Eigen::Vector3f*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Eigen::Vector3f), shape.vertices.size()));
  std::copy(shape.vertices.begin(), shape.vertices.end(), vertices);
  auto* triangles = static_cast<std::array<std::uint32_t, 3>*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(shape.triangles[0]), shape.triangles.size()));
  std::copy(shape.triangles.begin(), shape.triangles.end(), triangles);
  Scene scene(rtcNewScene(device_.get()));
  attach(scene.get(), geometry, 0);
  rtcCommitScene(scene.get());
  return scene;
}

void RayScene::build(const Clipmap& clipmap, const std::vector<Rock>& rocks) {
  scene_.reset(rtcNewScene(device_.get()));
  rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);  // no ray slips between two cells
  for (unsigned k = 0; k < clipmap.levels().size(); ++k) add_level(clipmap, k);
  if (!rocks.empty()) add_rocks(clipmap, rocks);
  tbb::task_arena(1).execute([&] { rtcCommitScene(scene_.get()); });
  if (rtcGetDeviceError(device_.get()) != RTC_ERROR_NONE) throw Error("the ray caster ran out of memory");
}

void RayScene::add_level(const Clipmap& clipmap, unsigned index) {
  const Clipmap::Level& level = clipmap.levels()[index];
  const unsigned stride = static_cast<unsigned>(clipmap.cells()) + 1,
                 block_cells = static_cast<unsigned>(clipmap.block());
  const unsigned per_side = (stride - 1) / block_cells;
  RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_GRID);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, level.vertices.data(), 0,
                             sizeof(Clipmap::Vertex), level.vertices.size() - 1);
  auto* grids = static_cast<RTCGrid*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_GRID, 0, RTC_FORMAT_GRID,
                                                              sizeof(RTCGrid), level.blocks.size()));
  for (const int block : level.blocks) {
    const unsigned row = static_cast<unsigned>(block) / per_side, col = static_cast<unsigned>(block) % per_side;
    *grids++ = {(row * stride + col) * block_cells, stride, static_cast<unsigned short>(block_cells + 1),
                static_cast<unsigned short>(block_cells + 1)};
  }
  attach(scene_.get(), geometry, index);
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
