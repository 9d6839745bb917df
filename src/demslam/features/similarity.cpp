// No Eigen here: these functions are compiled for several instruction sets (docs/architecture.md, "Eigen's ABI").
#include "demslam/features/similarity.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "demslam/features/vector_clones.h"

namespace demslam {
namespace {

constexpr std::size_t kLanes = 8, kPanel = 2 * kLanes, kTileRows = 4;
using Lanes = float __attribute__((vector_size(kLanes * sizeof(float))));
using Tile = std::array<float, kTileRows * kPanel>;

/// Train rows as panels of kPanel columns, so that the kernel reads them in order: panel, then component, then lane.
std::vector<float> panels_of(const Rows& rows) {
  const std::size_t panels = (rows.count + kPanel - 1) / kPanel;
  std::vector<float> packed(panels * rows.width * kPanel, 0.0F);
  for (std::size_t r = 0; r < rows.count; ++r) {
    float* panel = packed.data() + (r / kPanel) * rows.width * kPanel + r % kPanel;
    for (std::size_t k = 0; k < rows.width; ++k) panel[k * kPanel] = rows.data[r * rows.width + k];
  }
  return packed;
}

/// kTileRows x kPanel products; each is summed over k in ascending order.
DEMSLAM_VECTOR_CLONES void multiply_tile(const float* const* query, const float* panel, std::size_t width, float* out) {
  Lanes sum[kTileRows][2] = {};
  for (std::size_t k = 0; k < width; ++k) {
    Lanes low, high;
    std::memcpy(&low, panel + k * kPanel, sizeof low);
    std::memcpy(&high, panel + k * kPanel + kLanes, sizeof high);
#pragma GCC unroll 4
    for (std::size_t i = 0; i < kTileRows; ++i) {
      sum[i][0] += query[i][k] * low;
      sum[i][1] += query[i][k] * high;
    }
  }
  std::memcpy(out, sum, sizeof sum);
}

/// Keeps the best query of each train row.
DEMSLAM_VECTOR_CLONES void update_trains(const float* products, int query, std::size_t count, float* __restrict best,
                                         int* __restrict index) {
  for (std::size_t i = 0; i < count; ++i) {
    index[i] = products[i] > best[i] ? query : index[i];
    best[i] = products[i] > best[i] ? products[i] : best[i];
  }
}

DEMSLAM_VECTOR_CLONES float largest(const float* products) {
  float maximum = products[0];
  for (std::size_t i = 1; i < kPanel; ++i) maximum = products[i] > maximum ? products[i] : maximum;
  return maximum;
}

void update_query(BestTwo& best, const float* products, int first_train, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    if (products[i] > best.best) {
      best = {first_train + static_cast<int>(i), products[i], best.best};
    } else if (products[i] > best.second) {
      best.second = products[i];
    }
  }
}

}  // namespace

MutualBest best_products(const Rows& query, const Rows& train) {
  const std::vector<float> panels = panels_of(train);
  MutualBest result{std::vector<BestTwo>(query.count), std::vector<int>(train.count, -1)};
  std::vector<float> train_best(train.count, kNone);
  Tile tile;
  std::array<const float*, kTileRows> rows;
  for (std::size_t q = 0; q < query.count; q += kTileRows) {
    for (std::size_t i = 0; i < kTileRows; ++i) rows[i] = query.data + std::min(q + i, query.count - 1) * query.width;
    for (std::size_t t = 0; t < train.count; t += kPanel) {
      multiply_tile(rows.data(), &panels[t * train.width], train.width, tile.data());
      const std::size_t count = std::min(kPanel, train.count - t);
      for (std::size_t i = 0; i < kTileRows && q + i < query.count; ++i) {
        const float* products = &tile[i * kPanel];
        update_trains(products, static_cast<int>(q + i), count, &train_best[t], &result.of_train[t]);
        if (largest(products) > result.of_query[q + i].second) {
          update_query(result.of_query[q + i], products, static_cast<int>(t), count);
        }
      }
    }
  }
  return result;
}

}  // namespace demslam
