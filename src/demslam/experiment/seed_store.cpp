#include "demslam/experiment/seed_store.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "demslam/base/error.h"
#include "demslam/base/text.h"
#include "demslam/base/version.h"

namespace demslam {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

/// Name and place of every number of a score that is the same on every run.
template <class Score, class Visit>
void visit_figures(Score& s, const Visit& visit) {
  visit("ate_m", s.ate_m);
  visit("horizontal_m", s.horizontal_m);
  visit("vertical_m", s.vertical_m);
  visit("end_m", s.end_m);
  visit("nees", s.nees);
  visit("patches", s.anchoring.patches);
  visit("skipped_patches", s.anchoring.skipped_patches);
  visit("gated_patches", s.anchoring.gated_patches);
  visit("submaps_searched", s.anchoring.submaps.searched);
  visit("submaps_accepted", s.anchoring.submaps.accepted);
  visit("submaps_moved", s.anchoring.submaps.moved);
}

Json traverse_json(const TraverseOptions& t) {
  return {{"demslam", kVersion},
          {"seed", t.seed},
          {"relief", static_cast<int>(t.relief)},
          {"length_m", t.length_m},
          {"loop", t.loop},
          {"keyframe_spacing_m", t.keyframe_spacing_m},
          {"rotation_deg_per_sqrt_m", t.odometry.rotation_deg_per_sqrt_m},
          {"translation_m_per_sqrt_m", t.odometry.translation_m_per_sqrt_m},
          {"scale_sigma", t.odometry.scale_sigma},
          {"rotation_bias_deg_per_m", t.odometry.rotation_bias_deg_per_m},
          {"dem_cell_m", t.dem.cell_m},
          {"dem_noise_rms_m", t.dem.noise_rms_m},
          {"dem_noise_lengths_m", t.dem.noise_lengths_m},
          {"dem_bias_m", t.dem.bias_m},
          {"dem_shift_m", {t.dem.shift_m.x(), t.dem.shift_m.y()}},
          {"landmarks_per_keyframe", t.landmarks_per_keyframe},
          {"start_error_m", t.start_error_m},
          {"start_error_deg", t.start_error_deg}};
}

Json score_json(const EstimateScore& score) {
  Json json;
  visit_figures(score, [&](const char* name, auto value) { json[name] = value; });
  return json;
}

EstimateScore score_of(const Json& json) {
  EstimateScore score;
  visit_figures(score, [&](const char* name, auto& value) { json.at(name).get_to(value); });
  return score;
}

}  // namespace

SeedStore::SeedStore(fs::path folder) : folder_(std::move(folder)) {
  std::error_code failure;
  fs::create_directories(folder_ / "seeds", failure);
  if (failure) throw Error((folder_ / "seeds").string() + ": cannot be made: " + failure.message());
}

fs::path SeedStore::file_of(const TerrainScene& scene) const {
  return folder_ / "seeds" / (scene.name + "_" + std::to_string(scene.traverse.seed) + ".json");
}

ScoresByEstimator SeedStore::load(const TerrainScene& scene) const {
  ScoresByEstimator scores;
  const fs::path file = file_of(scene);
  if (!fs::exists(file)) return scores;
  const Json json = Json::parse(read_text(file), nullptr, false);
  if (json.is_discarded() || json.value("traverse", Json()) != traverse_json(scene.traverse)) return scores;
  for (const auto& [estimator, score] : json.at("scores").items()) scores[estimator] = score_of(score);
  return scores;
}

void SeedStore::save(const TerrainScene& scene, const ScoresByEstimator& scores) const {
  Json json = {{"scene", scene.name}, {"traverse", traverse_json(scene.traverse)}};
  for (const auto& [estimator, score] : scores) json["scores"][estimator] = score_json(score);
  const fs::path file = file_of(scene);
  write_text(file.string() + ".part", json.dump(1) + "\n");
  fs::rename(file.string() + ".part", file);
}

}  // namespace demslam
