#include "demslam/report/internal/images.h"

#include <algorithm>
#include <ranges>

#include "demslam/base/error.h"
#include "demslam/image/thumbnail.h"
#include "demslam/report/internal/packed.h"
#include "demslam/sim/rendered_sequence.h"

namespace demslam {
namespace {

/// The calibration that replaced the dataset's own: the first TOML among the inputs that lies outside the dataset.
std::string given_calibration(const nlohmann::json& inputs, const std::filesystem::path& dataset) {
  for (const auto& file : inputs.value("files", nlohmann::json::array())) {
    const std::filesystem::path path = file.value("path", "");
    const bool outside = path.lexically_relative(dataset).string().starts_with("..");
    if (path.extension() == ".toml" && outside) return path.string();
  }
  return "";
}

std::unique_ptr<StereoSequence> open_dataset_of(const ReportRun& run) {
  const auto summary = nlohmann::json::parse(run.summary);
  const auto inputs = summary.value("inputs", nlohmann::json::object());
  const std::filesystem::path dataset = inputs.value("dataset", "");
  if (!std::filesystem::exists(dataset)) throw Error("dataset " + dataset.string() + " is not there");
  const std::string calibration = given_calibration(inputs, dataset);
  if (is_rendered_dataset(dataset)) return open_rendered_dataset(dataset, calibration);
  return open_dataset(dataset, inputs.value("format", ""), calibration);
}

std::string dataset_name(const ReportRun& run) {
  return nlohmann::json::parse(run.summary)["inputs"].value("dataset", "");
}

}  // namespace

RunDataset::RunDataset(const ReportRun& run)
    : name_(dataset_name(run)), sequence_(open_dataset_of(run)), rectifier_(sequence_->rig()) {}

Image RunDataset::left(TimestampNs t_ns) const {
  const auto frames = std::views::iota(std::size_t{0}, sequence_->size());
  const auto frame = std::ranges::lower_bound(frames, t_ns, {}, [&](std::size_t f) { return sequence_->stamp_ns(f); });
  if (frame == frames.end() || sequence_->stamp_ns(*frame) != t_ns) throw Error(name_ + ": an image is missing");
  return rectifier_.left(sequence_->frame(*frame).left);
}

std::string ImageTable::jpeg(const RunDataset& dataset, TimestampNs t_ns) const {
  const auto make = [&] {
    return base64(jpeg_thumbnail(dataset.left(t_ns), options_.image_width_px, options_.image_quality));
  };
  if (cache_ == nullptr) return make();
  const auto known = cache_->find({dataset.name(), t_ns});
  return known != cache_->end() ? known->second
                                : cache_->emplace(std::pair{dataset.name(), t_ns}, make()).first->second;
}

std::optional<std::size_t> ImageTable::add(const RunDataset& dataset, TimestampNs t_ns) {
  const auto key = std::pair{dataset.name(), t_ns};
  if (const auto found = places_.find(key); found != places_.end()) return found->second;
  try {
    images_.push_back(
        {{"width_px", dataset.rig().width}, {"height_px", dataset.rig().height}, {"jpeg", jpeg(dataset, t_ns)}});
  } catch (const Error&) {
    return std::nullopt;
  }
  return places_[key] = images_.size() - 1;
}

}  // namespace demslam
