#pragma once

#include "demslam/features/features.h"

namespace demslam {

/// Mutual nearest neighbours of unit descriptors with Lowe's ratio on the Euclidean distance. Looks at no geometry.
/// A match's score is 1 - distance / 2, in [0, 1].
class NearestMatcher : public Matcher {
 public:
  explicit NearestMatcher(double ratio) : ratio_(ratio) {}

  /// Throws Error when the two sets' descriptors differ in width.
  std::vector<Match> match(const Features& query, const Features& train) override;

 private:
  double ratio_;
};

}  // namespace demslam
