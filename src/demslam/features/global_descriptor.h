#pragma once

#include <array>
#include <cstdint>

#include "demslam/features/features.h"

namespace demslam {

/// What a view looks like as a whole, in 128 bytes; compared by similarity(). All zero: nothing was seen.
using GlobalDescriptor = std::array<std::int8_t, 128>;

/// Cosine of two, in [-1, 1]; 0 where one of them is all zero.
double similarity(const GlobalDescriptor& a, const GlobalDescriptor& b);

/// Local descriptors -> one global descriptor: a VLAD (Jegou et al., CVPR 2010), each word's sum of residuals brought
/// to unit length (Arandjelovic and Zisserman, CVPR 2013), signed roots, all brought to fewer dimensions by random
/// signs (Achlioptas 2003). The words are learned from examples, since no file of them would fit every extractor. The
/// order of the rows does not matter, to the bit. Knows nothing of where in the image a descriptor stands.
class GlobalDescriber {
 public:
  static constexpr Eigen::Index kWords = 16;

  /// Learns the words from local descriptors, unit rows of any width, at least one; k-means on the sphere from fixed
  /// seeds, the same for the same examples.
  explicit GlobalDescriber(const DescriptorRows& examples);

  /// Of unit rows as wide as the examples; any number of them.
  GlobalDescriptor describe(const DescriptorRows& rows) const;

 private:
  DescriptorRows words_;       ///< kWords x width, unit rows
  DescriptorRows means_;       ///< of the examples nearest to each
  DescriptorRows projection_;  ///< dimensions x (kWords * width), signs
};

}  // namespace demslam
