#pragma once

#include <bit>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "demslam/geometry/camera.h"
#include "demslam/geometry/pose.h"

namespace demslam {

static_assert(std::endian::native == std::endian::little,
              "blobs are little-endian arrays, as numpy.frombuffer reads them");

/// The bytes of an array, as they lie in memory.
template <class Scalar>
std::string_view bytes_of(std::span<const Scalar> values) {
  return {reinterpret_cast<const char*>(values.data()), values.size_bytes()};
}

/// Throws Error unless the blob has exactly as many bytes as the array.
void read_bytes(std::string_view blob, std::span<std::byte> destination);

template <class Scalar>
std::vector<Scalar> array_of(std::string_view blob, std::size_t count) {
  std::vector<Scalar> values(count);
  read_bytes(blob, std::as_writable_bytes(std::span(values)));
  return values;
}

/// Seven doubles: quaternion w x y z, translation x y z. Exact: what is read has the bits of what was written.
std::string blob_of(const Pose& pose);
Pose pose_of(std::string_view blob);

/// 36 doubles, row-major.
std::string blob_of(const Matrix6d& matrix);
Matrix6d matrix_of(std::string_view blob);

/// Width, height, focal_px, cx, cy, baseline_m, T_body_left, p_body_ground as doubles.
std::string blob_of(const RectifiedRig& rig);
RectifiedRig rig_of(std::string_view blob);

}  // namespace demslam
