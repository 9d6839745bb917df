#pragma once

#include "demslam/features/features.h"

namespace demslam {

/// OpenCV's ORB and SIFT with their default options, to compare with. ORB's bits become +-1 rows, whose dot product
/// orders like the Hamming distance.
std::unique_ptr<Extractor> make_orb_extractor(int max_features);
std::unique_ptr<Extractor> make_sift_extractor(int max_features);

}  // namespace demslam
