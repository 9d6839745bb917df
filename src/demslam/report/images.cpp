#include "demslam/report/internal/images.h"
#include "demslam/base/error.h"
#include "demslam/image/thumbnail.h"
#include "demslam/report/internal/packed.h"

namespace demslam {
namespace {

std::unique_ptr<StereoSequence> open_dataset_of(const ReportRun& run) {
  const auto summary = nlohmann::json::parse(run.summary);
  const auto inputs = summary.value("inputs", nlohmann::json::object());
  const std::filesystem::path dataset = inputs.value("dataset", "");
  if (!std::filesystem::exists(dataset)) throw Error("dataset " + dataset.string() + " is not there");
  return open_dataset(dataset, inputs.value("format", ""), inputs.value("calibration", ""));
}

std::string dataset_name(const ReportRun& run) {
  return nlohmann::json::parse(run.summary)["inputs"].value("dataset", "");
}

}  // namespace

RunDataset::RunDataset(const ReportRun& run)
    : name_(dataset_name(run)), sequence_(open_dataset_of(run)), rectifier_(sequence_->rig()) {}

std::optional<std::size_t> ImageTable::add(const RunDataset& dataset, std::size_t frame) {
  const auto key = std::pair{dataset.name(), frame};
  if (const auto found = places_.find(key); found != places_.end()) return found->second;
  try {
    const std::string jpeg = jpeg_thumbnail(dataset.left(frame), options_.image_width_px, options_.image_quality);
    images_.push_back({{"frame", frame},
                       {"width_px", dataset.rig().width},
                       {"height_px", dataset.rig().height},
                       {"jpeg", base64(jpeg)}});
  } catch (const Error&) {
    return std::nullopt;
  }
  return places_[key] = images_.size() - 1;
}

}  // namespace demslam
