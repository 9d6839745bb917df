#pragma once

#include <cstddef>
#include <memory>

#include "demslam/dem/dem_reader.h"

namespace demslam {

/// The heights of a large DEM file, in tiles of 256 x 256 cells that are read when a cell of theirs is first asked for,
/// and kept. May be asked from several threads at once; at() throws Error when the file cannot be read.
class DemTiles {
 public:
  explicit DemTiles(DemReader reader);
  ~DemTiles();

  const DemRaster& grid() const;  ///< without heights
  float at(int row, int col) const;
  std::size_t tiles_read() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace demslam
