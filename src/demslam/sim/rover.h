#pragma once

#include "demslam/geometry/camera.h"
#include "demslam/geometry/trajectory.h"
#include "demslam/sim/route.h"
#include "demslam/sim/scene.h"
#include "demslam/sim/terrain.h"

namespace demslam {

/// T_map_body of a rover that stands with its wheels on the ground at `position`: the origin is the mean of the contact
/// points, pitch and roll are those of the plane through them (least squares: what a rocker-bogie levels out to).
/// Wheels press on a patch, not on a point: contact heights are means over it.
Pose standing_pose(const Terrain& terrain, const RoverOptions& rover, const Eigen::Vector2d& position, double heading);

/// T_map_body at every frame of the route's Schedule. Throws Error when it leaves the base surface or crosses a hole of
/// the DEM.
Trajectory drive(const Terrain& terrain, const RoverOptions& rover, const Route& route);

/// The stereo rig as mounted (T_body_left, T_left_right) with its intrinsics.
StereoRig stereo_rig(const CameraOptions& camera);

/// The rig as a wrong calibration states it.
StereoRig miscalibrated(StereoRig rig, const CalibrationErrorOptions& error);

}  // namespace demslam
