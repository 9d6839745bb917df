#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "demslam/features/features.h"
#include "demslam/geometry/camera.h"
#include "demslam/graph/pose_graph.h"
#include "demslam/odometry/motion.h"

namespace demslam {

/// A feature seen again: its number in the newer view, and its pixel in the older one.
struct SeenAgain {
  std::size_t feature = 0;
  Eigen::Vector2f pixel_before = Eigen::Vector2f::Zero();
};

/// The features of a keyframe as a picture shows them, best score first.
struct KeyframeView {
  std::vector<Eigen::Vector2f> pixels;  ///< rectified left image
  std::vector<float> disparities_px;    ///< 0: none
  std::vector<SeenAgain> matches;       ///< with the keyframe before
};

/// The best `max_features` of a keyframe and, where `before` is given, which of them the keyframe before saw too:
/// mutual nearest neighbours of the stored descriptors that agree with the measured motion within 3 px. The run's own
/// matcher may have found others; its matches are not stored.
KeyframeView view_of(const StereoFeatures& features, const StereoFeatures* before, const RelativePose* T_before_now,
                     const RectifiedRig& rig, std::size_t max_features);

}  // namespace demslam
