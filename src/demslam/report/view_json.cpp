#include "demslam/report/internal/view_json.h"

#include <algorithm>
#include <cmath>

#include "demslam/report/internal/packed.h"
#include "demslam/report/keyframe_views.h"

namespace demslam {
namespace {

using Json = nlohmann::ordered_json;

std::uint16_t eighths(float pixels) {
  return static_cast<std::uint16_t>(std::clamp(std::lround(8.0F * pixels), 0L, 65535L));
}

/// Indices of at most `count` of `size` things: every 2^n-th, so that the choice changes seldom while a run grows, and
/// the last one.
std::vector<std::size_t> evenly(std::size_t size, std::size_t count) {
  std::size_t step = 1;
  while (size / step + 2 > count && step < size && size > count) step *= 2;
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < size; i += step) chosen.push_back(i);
  if (size > 0 && chosen.back() != size - 1) chosen.push_back(size - 1);
  return chosen;
}

Json packed_features(const KeyframeView& view) {
  std::vector<std::uint16_t> numbers;
  for (std::size_t i = 0; i < view.pixels.size(); ++i) {
    for (const float value : {view.pixels[i].x(), view.pixels[i].y(), view.disparities_px[i]})
      numbers.push_back(eighths(value));
  }
  return packed(std::span<const std::uint16_t>(numbers));
}

Json packed_matches(const KeyframeView& view) {
  std::vector<std::uint16_t> numbers;
  for (const SeenAgain& match : view.matches) {
    numbers.push_back(static_cast<std::uint16_t>(match.feature));
    numbers.push_back(eighths(match.pixel_before.x()));
    numbers.push_back(eighths(match.pixel_before.y()));
  }
  return packed(std::span<const std::uint16_t>(numbers));
}

/// The odometry factors of a map by their newer keyframe.
class MapFeatures {
 public:
  MapFeatures(const MapStore& map, const RectifiedRig& rig) : map_(map), rig_(rig) {
    for (const StoredFactor& factor : map.factors()) {
      if (factor.kind == FactorKind::odometry) odometry_[factor.measurement.j] = factor.measurement;
    }
  }
  void add_to(Json& json, std::size_t keyframe, std::size_t max_features) const {
    if (keyframe >= map_.keyframe_count()) return;
    const auto factor = odometry_.find(keyframe);
    const bool tied = factor != odometry_.end();
    const auto before = tied ? map_.features(factor->second.i) : nullptr;
    const KeyframeView view =
        view_of(*map_.features(keyframe), before.get(), tied ? &factor->second : nullptr, rig_, max_features);
    json["features"] = packed_features(view);
    json["matches"] = packed_matches(view);
    if (tied) json["matched_with"] = factor->second.i;
  }

 private:
  const MapStore& map_;
  RectifiedRig rig_;
  std::map<std::size_t, RelativePose> odometry_;
};

}  // namespace

Json views_json(const std::vector<KeyframePose>& keyframes, const MapStore* map, const RunDataset& dataset,
                const PageOptions& options, ImageTable& images) {
  std::optional<MapFeatures> features;
  if (map != nullptr) features.emplace(*map, dataset.rig());
  Json views = Json::array();
  for (const std::size_t k : evenly(keyframes.size(), options.images)) {
    const auto image = images.add(dataset, keyframes[k].t_ns);
    if (!image) continue;
    Json view = {{"keyframe", keyframes[k].number}, {"image", *image}};
    if (features) features->add_to(view, keyframes[k].number, options.features);
    views.push_back(std::move(view));
  }
  return views;
}

}  // namespace demslam
