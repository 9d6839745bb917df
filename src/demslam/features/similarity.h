#pragma once

#include <cstddef>
#include <vector>

namespace demslam {

inline constexpr float kNone = -2.0F;  ///< below every cosine

/// The two best dot products of one row against a set, and where the best is; -1 and kNone: the set was empty.
struct BestTwo {
  int index = -1;
  float best = kNone, second = kNone;
};

/// Row-major rows of `width` floats, without padding.
struct Rows {
  const float* data = nullptr;
  std::size_t count = 0, width = 0;
};

struct MutualBest {
  std::vector<BestTwo> of_query;  ///< best train rows of each query row; ties go to the lower index
  std::vector<int> of_train;      ///< best query row of each train row, -1 without queries
};

/// All dot products of query with train rows, reduced on the fly. Every product is summed in the same order on every
/// processor, so the result is the same to the bit whatever vector width is used.
MutualBest best_products(const Rows& query, const Rows& train);

}  // namespace demslam
