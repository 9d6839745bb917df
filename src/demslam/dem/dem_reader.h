#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "demslam/dem/dem.h"

namespace demslam {

/// A DEM file, read part by part: a large one never lies in memory as a whole. See read_dem() for what is read and what
/// is refused. One instance is used by one thread at a time.
class DemReader {
 public:
  explicit DemReader(const std::filesystem::path& file, const std::optional<Eigen::Vector3d>& origin = std::nullopt);
  ~DemReader();
  DemReader(DemReader&&) noexcept;

  const DemRaster& grid() const;  ///< the whole raster but for its heights
  DemRaster read(const CellWindow& window);
  void read(const CellWindow& window, float* heights);

 private:
  struct Source;
  std::unique_ptr<Source> source_;
};

}  // namespace demslam
