#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "demslam/image/image.h"

namespace demslam {

using DescriptorRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Keypoints of one image with their descriptors, one row each.
struct Features {
  int image_width = 0, image_height = 0;   ///< pixels; matchers normalise with it
  std::vector<Eigen::Vector2f> keypoints;  ///< (u, v) pixels, sub-pixel; centre of the first pixel is (0, 0)
  std::vector<float> scores;               ///< larger is better
  DescriptorRows descriptors;              ///< keypoints.size() x width, unit rows

  std::size_t size() const { return keypoints.size(); }
};

struct Match {
  int query = 0, train = 0;  ///< indices into the first and the second feature set
  float score = 0.0F;        ///< in (0, 1], larger is better
};

/// Image -> keypoints, scores, descriptors. Deterministic; one instance is used by one thread at a time.
class Extractor {
 public:
  virtual ~Extractor() = default;
  virtual Features extract(const Image& image) = 0;
};

/// Two feature sets -> one-to-one matches. Deterministic; one instance is used by one thread at a time.
class Matcher {
 public:
  virtual ~Matcher() = default;
  virtual std::vector<Match> match(const Features& query, const Features& train) = 0;
};

}  // namespace demslam
