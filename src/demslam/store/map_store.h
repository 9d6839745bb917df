#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "demslam/base/time.h"
#include "demslam/base/version.h"
#include "demslam/geometry/camera.h"
#include "demslam/geometry/pose.h"
#include "demslam/graph/pose_graph.h"
#include "demslam/odometry/motion.h"

namespace demslam {

inline constexpr int kMapSchema = 1;

/// What a map says of itself; written once.
struct MapHeader {
  RectifiedRig rig;
  std::string config_toml;  ///< effective options
  std::string inputs;       ///< identification of what was read: paths and SHA-256, as text
  std::string version = kVersion;
};

struct StoredKeyframe {
  std::size_t index = 0;  ///< 0, 1, 2, ... in the order of appending
  std::size_t frame = 0;  ///< index of its frame in the sequence
  TimestampNs t_ns = 0;
  Pose T_map_body;           ///< as first estimated
  Pose T_map_body_odometry;  ///< by odometry alone
  std::string payload;       ///< opaque here: what else belongs to the keyframe for good, such as its DEM factors
};

/// A frame, held relative to its keyframe so that it moves along with it.
struct StoredFrame {
  std::size_t index = 0;  ///< in the sequence
  TimestampNs t_ns = 0;
  std::string status;
  std::size_t keyframe = 0;
  Pose T_keyframe_body;
  std::string record;  ///< its line of frames.jsonl
};

enum class FactorKind { odometry, loop };

struct StoredFactor {
  FactorKind kind = FactorKind::odometry;
  RelativePose measurement;
  std::string status = "accepted";
  double chi_square = 0.0;
  int inliers = 0;
};

/// A later change of mind about a factor. Factors count from 0 in the order of appending.
struct FactorStatus {
  std::size_t factor = 0;
  std::string status;
};

/// The newest estimate of a keyframe: of the last optimisation in the run, or of the one at its end.
struct StoredEstimate {
  std::size_t keyframe = 0;
  Pose T_map_body;
  std::optional<Matrix6d> covariance;  ///< of the right perturbation; known after the run's end
};

/// Everything that becomes durable together with a keyframe.
struct KeyframeEntry {
  StoredKeyframe keyframe;
  std::shared_ptr<const StereoFeatures> features;
  std::vector<StoredFactor> factors;
  std::vector<FactorStatus> factor_statuses;  ///< of earlier factors
  std::vector<StoredFrame> frames;            ///< since the last keyframe, this keyframe's own included
  std::vector<std::pair<std::size_t, Pose>>
      T_map_body;          ///< keyframes that an optimisation has moved since the last entry
  std::string checkpoint;  ///< opaque here: what is needed to go on from this keyframe exactly
};

/// Exact: floats, bit for bit. Bytes: a quarter of the size, rows of signed bytes with a scale each, off by at most
/// 0.4 % of the row's largest component; the same bytes whenever they are read.
enum class DescriptorCoding { exact, bytes };

struct MapStoreOptions {
  DescriptorCoding descriptors = DescriptorCoding::exact;
};

/// The map of a run on disk: one SQLite file in write-ahead mode, `<map>.lock` beside it while it is written. A
/// keyframe with all that belongs to it is one transaction: a process killed at any moment leaves whole keyframes only.
/// Memory stays flat: features are read when they are asked for. Every failure (full disk, damage, a newer schema, a
/// second writer) is an Error that names the file, and leaves what was stored before. One thread at a time.
class MapStore {
 public:
  /// A new map. Throws Error when the file exists.
  static MapStore create(const std::filesystem::path& file, const MapHeader& header,
                         const MapStoreOptions& options = {});
  /// An existing map, to be extended. Throws Error, the file untouched, when it is damaged, of a newer schema or no
  /// map.
  static MapStore open(const std::filesystem::path& file, const MapStoreOptions& options = {});
  /// An existing map, to be read, be it while another process writes it.
  static MapStore open_read_only(const std::filesystem::path& file);

  ~MapStore();
  MapStore(MapStore&&) noexcept;
  MapStore& operator=(MapStore&&) noexcept;

  /// Adds keyframe `keyframe_count()`; one transaction.
  void append(const KeyframeEntry& entry);
  /// Frames after the last keyframe, at the end of a run.
  void append_frames(const std::vector<StoredFrame>& frames);
  /// The estimates at the end of a run. Those of the run itself are kept beside them for `rewind`.
  void set_final_estimates(const std::vector<StoredEstimate>& estimates);
  /// Back to the moment of the last `append`: drops later frames and final estimates.
  void rewind();

  MapHeader header() const;
  std::size_t keyframe_count() const;
  StoredKeyframe keyframe(std::size_t index) const;
  std::vector<StoredKeyframe> keyframes() const;
  std::shared_ptr<const StereoFeatures> features(std::size_t keyframe) const;
  std::vector<StoredFactor> factors() const;
  std::vector<StoredEstimate> estimates() const;
  void for_each_frame(const std::function<void(const StoredFrame&)>& visit) const;
  /// Of the last keyframe; empty when there is none.
  std::string checkpoint() const;

 private:
  struct State;
  explicit MapStore(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace demslam
