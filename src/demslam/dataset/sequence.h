#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "demslam/base/time.h"
#include "demslam/dataset/start_pose.h"
#include "demslam/geometry/camera.h"
#include "demslam/image/image.h"

namespace demslam {

/// One raw (unrectified) stereo pair. Both images have the rig's size.
struct StereoFrame {
  TimestampNs t_ns = 0;
  Image left, right;
};

/// A stereo sequence: calibration, stamps in strictly increasing order, random access to the pairs.
/// It knows nothing of ground truth: `evaluation` reads that by itself.
class StereoSequence {
 public:
  virtual ~StereoSequence() = default;

  virtual std::string format() const = 0;  ///< "demslam", "kitti", "euroc", "folders", ...
  virtual const StereoRig& rig() const = 0;
  virtual std::size_t size() const = 0;
  virtual TimestampNs stamp_ns(std::size_t index) const = 0;
  /// Reads pair `index`. Throws Error naming the file when an image is missing, unreadable or of another size.
  /// May be called from several threads at once.
  virtual StereoFrame frame(std::size_t index) const = 0;

  /// Images left out because their partner of the other camera is missing.
  virtual std::size_t unpaired() const { return 0; }
  /// The DEM that comes with the dataset, if any.
  virtual std::optional<std::filesystem::path> dem_file() const { return std::nullopt; }
  /// What the mission knows of the first pose (start.toml), if anything.
  virtual std::optional<StartPose> start() const { return std::nullopt; }
  /// The files that define the input besides the images (calibration, start, stamps), for the run's record of SHA-256.
  virtual std::vector<std::filesystem::path> definition_files() const { return {}; }
};

/// Opens a dataset; `format` empty means: recognised from what is in the folder. `calibration` replaces the dataset's
/// own. Throws Error when nothing fits, the sequence is empty or the calibration cannot be real.
std::unique_ptr<StereoSequence> open_dataset(const std::filesystem::path& path, const std::string& format = "",
                                             const std::filesystem::path& calibration = {});

/// The names `format` may have.
std::vector<std::string> dataset_formats();

}  // namespace demslam
