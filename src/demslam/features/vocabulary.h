#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "demslam/features/features.h"

namespace demslam {

/// A few typical descriptors ("words"), and whole images described by them: VLAD (Jegou et al. 2010), the descriptors'
/// residuals summed per word, each word's sum normalised, then the whole. Two views of one place have a large scalar
/// product, whatever the order of their keypoints.
class Vocabulary {
 public:
  /// k-means from a seed over all rows; fewer rows than words give fewer words. Same input, same words.
  static Vocabulary train(const std::vector<const DescriptorRows*>& images, int words, std::uint64_t seed);

  Eigen::Index words() const { return centres_.rows(); }
  /// A unit vector of words() times descriptor width; zero for an image without keypoints.
  Eigen::VectorXf describe(const DescriptorRows& descriptors) const;

 private:
  std::vector<Eigen::Index> nearest(const DescriptorRows& descriptors) const;

  DescriptorRows centres_;
};

}  // namespace demslam
