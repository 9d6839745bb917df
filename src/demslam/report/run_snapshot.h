#pragma once

#include <filesystem>

namespace demslam {

/// A run that goes on, as a run folder of its own: the frames that its map.db holds so far, at the poses with which the
/// run would end now, by links to what needs no change. Temporary: removed with the object. Never writes to the run.
class RunSnapshot {
 public:
  /// Throws Error where the run has placed no keyframe yet, or the map cannot be read.
  explicit RunSnapshot(const std::filesystem::path& run);
  ~RunSnapshot();
  RunSnapshot(const RunSnapshot&) = delete;
  RunSnapshot& operator=(const RunSnapshot&) = delete;

  /// Its last part is the run's own name.
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace demslam
