#include "demslam/store/blob.h"

#include <array>

#include "demslam/base/error.h"

namespace demslam {
namespace {

using PoseArray = std::array<double, 7>;
using RigArray = std::array<double, 16>;
using MatrixArray = std::array<double, 36>;

template <class Array>
std::string blob_of_array(const Array& values) {
  return std::string(bytes_of(std::span<const double>(values)));
}

template <class Array>
Array array_of_blob(std::string_view blob) {
  Array values;
  read_bytes(blob, std::as_writable_bytes(std::span(values)));
  return values;
}

PoseArray array_of_pose(const Pose& pose) {
  const auto& q = pose.rotation();
  const auto& p = pose.translation();
  return {q.w(), q.x(), q.y(), q.z(), p.x(), p.y(), p.z()};
}

Pose pose_of_array(const double* v) { return Pose::exactly({v[0], v[1], v[2], v[3]}, {v[4], v[5], v[6]}); }

}  // namespace

void read_bytes(std::string_view blob, std::span<std::byte> destination) {
  if (blob.size() != destination.size()) {
    throw Error("a stored value has " + std::to_string(blob.size()) + " bytes instead of " +
                std::to_string(destination.size()) +
                ": the map is damaged; restore a copy, or remove it and run again");
  }
  if (!blob.empty()) std::memcpy(destination.data(), blob.data(), blob.size());
}

std::string blob_of(const Pose& pose) { return blob_of_array(array_of_pose(pose)); }

Pose pose_of(std::string_view blob) { return pose_of_array(array_of_blob<PoseArray>(blob).data()); }

std::string blob_of(const Matrix6d& matrix) {
  MatrixArray values;
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = matrix(static_cast<int>(i / 6), static_cast<int>(i % 6));
  return blob_of_array(values);
}

Matrix6d matrix_of(std::string_view blob) {
  const MatrixArray values = array_of_blob<MatrixArray>(blob);
  return Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(values.data());
}

std::string blob_of(const RectifiedRig& rig) {
  const auto& g = rig.p_body_ground;
  RigArray values{double(rig.width), double(rig.height), rig.focal_px, rig.cx, rig.cy, rig.baseline_m};
  const PoseArray pose = array_of_pose(rig.T_body_left);
  std::copy(pose.begin(), pose.end(), values.begin() + 6);
  std::copy(g.begin(), g.end(), values.begin() + 13);
  return blob_of_array(values);
}

RectifiedRig rig_of(std::string_view blob) {
  const RigArray v = array_of_blob<RigArray>(blob);
  return {.width = static_cast<int>(v[0]),
          .height = static_cast<int>(v[1]),
          .focal_px = v[2],
          .cx = v[3],
          .cy = v[4],
          .baseline_m = v[5],
          .T_body_left = pose_of_array(&v[6]),
          .p_body_ground = {v[13], v[14], v[15]}};
}

}  // namespace demslam
