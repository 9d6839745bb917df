#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "demslam/dataset/sequence.h"
#include "demslam/image/rectify.h"
#include "demslam/report/report_page.h"

namespace demslam {

/// The dataset of a run, with its images as the run saw them: rectified.
class RunDataset {
 public:
  /// Throws Error when it is not there any more.
  explicit RunDataset(const ReportRun& run);
  const RectifiedRig& rig() const { return rectifier_.rig(); }
  const std::string& name() const { return name_; }
  /// Throws Error when the dataset has no such image (any more).
  Image left(TimestampNs t_ns) const;

 private:
  std::string name_;
  std::unique_ptr<StereoSequence> sequence_;
  Rectifier rectifier_;
};

/// The page's images, each kept once however many runs show it.
class ImageTable {
 public:
  /// `cache` may be null.
  ImageTable(const PageOptions& options, ImageCache* cache) : options_(options), cache_(cache) {}
  /// The image's place in the table; nothing when it cannot be read.
  std::optional<std::size_t> add(const RunDataset& dataset, TimestampNs t_ns);
  nlohmann::ordered_json take() { return std::move(images_); }

 private:
  std::string jpeg(const RunDataset& dataset, TimestampNs t_ns) const;

  PageOptions options_;
  ImageCache* cache_;
  std::map<std::pair<std::string, TimestampNs>, std::size_t> places_;
  nlohmann::ordered_json images_ = nlohmann::ordered_json::array();
};

}  // namespace demslam
