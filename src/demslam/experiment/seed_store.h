#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

#include "demslam/experiment/estimator.h"
#include "demslam/experiment/terrain_scenes.h"

namespace demslam {

using ScoresByEstimator = std::map<std::string, EstimateScore>;

/// Results of single seeds on disk, DIR/seeds/SCENE_SEED.json, so that an interrupted experiment goes on where it
/// stopped. A file made with another traverse, or by another version, is not used again. Wall-clock figures are
/// not kept: they are zero in a score that was read back.
class SeedStore {
 public:
  /// Makes the folder. Throws Error when it cannot.
  explicit SeedStore(std::filesystem::path folder);

  ScoresByEstimator load(const TerrainScene& scene) const;
  /// Whole or not at all.
  void save(const TerrainScene& scene, const ScoresByEstimator& scores) const;

 private:
  std::filesystem::path file_of(const TerrainScene& scene) const;

  std::filesystem::path folder_;
};

}  // namespace demslam
