// No Eigen here: these functions are compiled for several instruction sets (docs/architecture.md, "Eigen's ABI").
#include "demslam/features/similarity.h"

#include <algorithm>
#include <array>
#include <cstring>

namespace demslam {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define DEMSLAM_CLONES  // sanitizers run before the resolvers of cloned functions may
#else
#define DEMSLAM_CLONES __attribute__((target_clones("default", "avx2", "avx512f")))
#endif

constexpr std::size_t kLanes = 16, kTileRows = 4;
using Lanes = float __attribute__((vector_size(kLanes * sizeof(float)), aligned(4)));
using Tile = std::array<float, kTileRows * kLanes>;

/// Train rows as panels of kLanes columns, so that the kernel reads them in order: panel, then component, then lane.
std::vector<float> panels_of(const Rows& rows) {
  const std::size_t panels = (rows.count + kLanes - 1) / kLanes;
  std::vector<float> packed(panels * rows.width * kLanes, 0.0F);
  for (std::size_t r = 0; r < rows.count; ++r) {
    float* panel = packed.data() + (r / kLanes) * rows.width * kLanes + r % kLanes;
    for (std::size_t k = 0; k < rows.width; ++k) panel[k * kLanes] = rows.data[r * rows.width + k];
  }
  return packed;
}

/// kTileRows x kLanes products; each is summed over k in ascending order.
DEMSLAM_CLONES void multiply_tile(const float* const* query, const float* panel, std::size_t width, float* out) {
  Lanes sum0{}, sum1{}, sum2{}, sum3{};
  for (std::size_t k = 0; k < width; ++k) {
    Lanes column;
    std::memcpy(&column, panel + k * kLanes, sizeof column);
    sum0 += query[0][k] * column;
    sum1 += query[1][k] * column;
    sum2 += query[2][k] * column;
    sum3 += query[3][k] * column;
  }
  std::memcpy(out, &sum0, sizeof sum0);
  std::memcpy(out + kLanes, &sum1, sizeof sum1);
  std::memcpy(out + 2 * kLanes, &sum2, sizeof sum2);
  std::memcpy(out + 3 * kLanes, &sum3, sizeof sum3);
}

void update(BestTwo& best, float product, int index) {
  if (product > best.best) {
    best = {index, product, best.best};
  } else if (product > best.second) {
    best.second = product;
  }
}

class Reduction {
 public:
  Reduction(std::size_t queries, std::size_t trains)
      : result_{std::vector<BestTwo>(queries), std::vector<int>(trains, -1)}, train_best_(trains, -2.0F) {}

  void add(std::size_t query, std::size_t first_train, const float* products) {
    const std::size_t count = std::min(kLanes, train_best_.size() - first_train);
    for (std::size_t lane = 0; lane < count; ++lane) {
      const std::size_t train = first_train + lane;
      update(result_.of_query[query], products[lane], static_cast<int>(train));
      if (products[lane] > train_best_[train]) {
        train_best_[train] = products[lane];
        result_.of_train[train] = static_cast<int>(query);
      }
    }
  }
  MutualBest take() { return std::move(result_); }

 private:
  MutualBest result_;
  std::vector<float> train_best_;
};

}  // namespace

MutualBest best_products(const Rows& query, const Rows& train) {
  const std::vector<float> panels = panels_of(train);
  Reduction reduction(query.count, train.count);
  Tile tile;
  for (std::size_t q = 0; q < query.count; q += kTileRows) {
    std::array<const float*, kTileRows> rows;
    for (std::size_t i = 0; i < kTileRows; ++i) rows[i] = query.data + std::min(q + i, query.count - 1) * query.width;
    for (std::size_t t = 0; t < train.count; t += kLanes) {
      multiply_tile(rows.data(), panels.data() + t * train.width, train.width, tile.data());
      for (std::size_t i = 0; i < kTileRows && q + i < query.count; ++i) reduction.add(q + i, t, &tile[i * kLanes]);
    }
  }
  return reduction.take();
}

}  // namespace demslam
