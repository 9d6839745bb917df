#include "demslam/dem/dem_tiles.h"

#include <algorithm>
#include <atomic>
#include <deque>
#include <mutex>
#include <vector>

namespace demslam {
namespace {

constexpr int kSide = 256;

int tiles_along(int cells) { return (cells + kSide - 1) / kSide; }

}  // namespace

struct DemTiles::State {
  explicit State(DemReader source)
      : reader(std::move(source)),
        across(tiles_along(reader.grid().cols)),
        heights(static_cast<std::size_t>(tiles_along(reader.grid().rows)) * across) {}

  /// Tiles are as wide as the raster allows; the last of a row is narrower.
  int width(int tile_col) const { return std::min(kSide, reader.grid().cols - tile_col * kSide); }

  const float* load(int tile_row, int tile_col) {
    const std::lock_guard lock(mutex);
    std::atomic<const float*>& slot = heights[static_cast<std::size_t>(tile_row) * across + tile_col];
    if (const float* const there = slot.load(std::memory_order_relaxed)) return there;
    const CellWindow window{tile_row * kSide, tile_col * kSide, std::min(kSide, reader.grid().rows - tile_row * kSide),
                            width(tile_col)};
    std::vector<float> tile(static_cast<std::size_t>(window.rows) * window.cols);
    reader.read(window, tile.data());
    tiles.push_back(std::move(tile));
    slot.store(tiles.back().data(), std::memory_order_release);
    return tiles.back().data();
  }

  DemReader reader;
  int across;
  std::vector<std::atomic<const float*>> heights;  ///< per tile; null: not read yet
  std::deque<std::vector<float>> tiles;
  std::mutex mutex;
};

DemTiles::DemTiles(DemReader reader) : state_(std::make_unique<State>(std::move(reader))) {}
DemTiles::~DemTiles() = default;

const DemRaster& DemTiles::grid() const { return state_->reader.grid(); }

float DemTiles::at(int row, int col) const {
  const int tile_row = row / kSide, tile_col = col / kSide;
  const float* tile =
      state_->heights[static_cast<std::size_t>(tile_row) * state_->across + tile_col].load(std::memory_order_acquire);
  if (tile == nullptr) tile = state_->load(tile_row, tile_col);
  return tile[static_cast<std::size_t>(row % kSide) * state_->width(tile_col) + col % kSide];
}

std::size_t DemTiles::tiles_read() const {
  const std::lock_guard lock(state_->mutex);
  return state_->tiles.size();
}

}  // namespace demslam
