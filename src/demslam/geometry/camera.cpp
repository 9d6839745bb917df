#include "demslam/geometry/camera.h"

#include <cmath>
#include <string>

#include "demslam/base/error.h"

namespace demslam {
namespace {

void check_camera(const Camera& camera, const std::string& where) {
  if (camera.width <= 0 || camera.height <= 0) throw Error(where + ": image size must be positive");
  for (const double focal : {camera.fx, camera.fy}) {
    if (!std::isfinite(focal) || focal <= 0.0) {
      throw Error(where + ": focal length must be positive, it is " + std::to_string(focal) + " px");
    }
  }
  const auto inside = [](double c, int size) { return std::isfinite(c) && c > -0.5 * size && c < 1.5 * size; };
  if (!inside(camera.cx, camera.width) || !inside(camera.cy, camera.height)) {
    throw Error(where + ": principal point lies far outside the image; check cx and cy (pixels)");
  }
  for (const double k : camera.coefficients) {
    if (!std::isfinite(k)) throw Error(where + ": a distortion coefficient is not a number");
  }
}

}  // namespace

void check_rig(const StereoRig& rig, const std::string& source) {
  check_camera(rig.left, source + ": left camera");
  check_camera(rig.right, source + ": right camera");
  if (rig.left.width != rig.right.width || rig.left.height != rig.right.height) {
    throw Error(source + ": left and right images must have the same size");
  }
  const double baseline_m = rig.T_left_right.translation().norm();
  if (!std::isfinite(baseline_m) || baseline_m < 1e-4) {
    throw Error(source + ": the baseline must be positive, it is " + std::to_string(baseline_m) + " m");
  }
  if (baseline_m > 10.0) {
    throw Error(source + ": a baseline of " + std::to_string(baseline_m) + " m is absurd; is it in millimetres?");
  }
}

}  // namespace demslam
