#include "demslam/experiment/frontend_experiment.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "demslam/base/time.h"
#include "demslam/experiment/spread.h"
#include "demslam/odometry/motion.h"
#include "demslam/odometry/stereo_geometry.h"

namespace demslam {
namespace {

constexpr double kRight_px = 3.0, kRow_px = 1.5, kSky_m = 1000.0;
constexpr double kFailed = std::numeric_limits<double>::infinity();

/// What one front-end has done so far on one group.
struct Tally {
  std::string group, frontend;
  int pairs = 0, failed = 0;
  bool has_truth = true;
  double points = 0, matches = 0, judged = 0, stereo = 0, on_row = 0, extract_ms = 0, match_ms = 0;
  std::vector<double> right;                  ///< of every pair
  std::vector<double> angles_deg, offsets_m;  ///< of every pair; infinite: failed
};

double depth_at(const ViewPair& pair, const StereoFeatures& a, std::size_t i) {
  if (pair.depth_a_m.empty()) return a.has_depth(i) ? pair.rig.depth_m(a.disparity_px[i]) : kSky_m;
  const Eigen::Vector2i pixel = a.left.keypoints[i].array().round().cast<int>();
  return pair.depth_a_m[static_cast<std::size_t>(pixel.y()) * pair.rig.width + pixel.x()];
}

/// Where b must see point i of a; nothing where a's depth is not known.
std::optional<Eigen::Vector2d> place_in_b(const ViewPair& pair, const StereoFeatures& a, std::size_t i,
                                          const Pose& T_a_b) {
  const double depth_m = depth_at(pair, a, i);
  if (!(depth_m < kSky_m)) return std::nullopt;
  const Eigen::Vector2d pixel = a.left.keypoints[i].cast<double>();
  const Eigen::Vector3d p_b = T_a_b.inverse() * pair.rig.unproject(pixel, pair.rig.disparity_px(depth_m));
  return p_b.z() > 0.0 ? std::optional(pair.rig.project(p_b)) : std::nullopt;
}

void judge_matches(Tally& tally, const ViewPair& pair, const StereoFeatures& a, const StereoFeatures& b,
                   const std::vector<Match>& matches, const Pose& T_a_b) {
  for (const Match& match : matches) {
    const auto place = place_in_b(pair, a, static_cast<std::size_t>(match.query), T_a_b);
    if (!place) continue;
    tally.judged += 1;
    tally.right.back() += (*place - b.left.keypoints[match.train].cast<double>()).norm() <= kRight_px;
  }
}

void judge_rows(Tally& tally, const Features& left, const Features& right, const std::vector<Match>& matches) {
  std::vector<double> rows;
  rows.reserve(matches.size());
  for (const Match& m : matches) rows.push_back(right.keypoints[m.train].y() - left.keypoints[m.query].y());
  if (rows.empty()) return;
  const double offset_px = spread_of(rows).median;  // a calibration may be off by a constant
  tally.stereo += static_cast<double>(rows.size());
  tally.on_row += static_cast<double>(
      std::ranges::count_if(rows, [&](double row) { return std::abs(row - offset_px) <= kRow_px; }));
}

void judge_motion(Tally& tally, const std::optional<Pose>& truth_T_a_b, const Motion& motion) {
  tally.failed += !motion.ok;
  if (!truth_T_a_b) return;
  const Pose error = truth_T_a_b->inverse() * motion.T_a_b;
  const double angle = 2.0 * std::atan2(error.rotation().vec().norm(), std::abs(error.rotation().w()));
  tally.angles_deg.push_back(motion.ok ? angle * 180.0 / std::numbers::pi : kFailed);
  tally.offsets_m.push_back(motion.ok ? error.translation().norm() : kFailed);
}

/// One front-end on one pair.
void tally_pair(Tally& tally, Frontend& frontend, const ViewPair& pair) {
  const CpuStopwatch extracting;
  Features left_a = frontend.extractor->extract(pair.left_a), left_b = frontend.extractor->extract(pair.left_b);
  tally.extract_ms += extracting.elapsed_ms() / 2.0;
  const CpuStopwatch matching;
  const std::vector<Match> matches = frontend.matcher->match(left_a, left_b);
  tally.match_ms += matching.elapsed_ms();
  const Features right_a = frontend.extractor->extract(pair.right_a);
  judge_rows(tally, left_a, right_a, frontend.matcher->match(left_a, right_a));
  const MotionOptions options;
  const StereoFeatures a = match_stereo(pair.rig, std::move(left_a), pair.left_a, pair.right_a, options);
  const StereoFeatures b = match_stereo(pair.rig, std::move(left_b), pair.left_b, pair.right_b, options);
  const Motion motion = estimate_motion(pair.rig, a, b, *frontend.matcher, options);
  tally.pairs += 1;
  tally.has_truth = pair.T_a_b.has_value();
  tally.points += static_cast<double>(a.left.size());
  tally.matches += static_cast<double>(matches.size());
  tally.right.push_back(0.0);
  if (pair.T_a_b || motion.ok) judge_matches(tally, pair, a, b, matches, pair.T_a_b.value_or(motion.T_a_b));
  judge_motion(tally, pair.T_a_b, motion);
}

double percent(double part, double whole) { return whole > 0.0 ? 100.0 * part / whole : 0.0; }

struct Mean {
  double value = 0.0, half_interval = 0.0;  ///< 95 %
};

Mean mean_of(const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  if (values.empty()) return {};
  const double mean = std::reduce(values.begin(), values.end()) / n;
  double squares = 0.0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  return {mean, n > 1.0 ? 1.96 * std::sqrt(squares / (n * (n - 1.0))) : 0.0};
}

FrontendRow row_of(const Tally& t) {
  const double pairs = t.pairs;
  const Mean right = mean_of(t.right);
  FrontendRow row{.group = t.group,
                  .frontend = t.frontend,
                  .pairs = t.pairs,
                  .points = t.points / pairs,
                  .matches = t.matches / pairs,
                  .right = right.value,
                  .right_95 = right.half_interval,
                  .precision = percent(right.value * static_cast<double>(t.right.size()), t.judged),
                  .on_row = percent(t.on_row, t.stereo),
                  .has_truth = t.has_truth,
                  .failed = t.failed,
                  .extract_ms = t.extract_ms / pairs,
                  .match_ms = t.match_ms / pairs};
  for (int i = 0; i < 3; ++i) {
    row.angle_auc[i] = area_under_recall(t.angles_deg, kAngles_deg[i]);
    row.offset_auc[i] = area_under_recall(t.offsets_m, kOffsets_m[i]);
  }
  int found = 0;
  for (std::size_t i = 0; i < t.angles_deg.size(); ++i) {
    found += t.angles_deg[i] < kAngles_deg[2] && t.offsets_m[i] < kOffsets_m[2];
  }
  row.recall = percent(found, static_cast<double>(t.angles_deg.size()));
  row.wrong = static_cast<int>(t.angles_deg.size()) - found - (t.has_truth ? t.failed : 0);
  return row;
}

/// All front-ends, and their tallies by group in order of appearance.
class Comparison {
 public:
  explicit Comparison(const std::vector<NamedFrontend>& frontends) : named_(frontends) {
    for (const NamedFrontend& one : frontends) made_.push_back(make_frontend(one.options));
  }

  void add(const ViewPair& pair) {
    const std::size_t first = group(pair.group);
    for (std::size_t i = 0; i < made_.size(); ++i) tally_pair(tallies_[first + i], made_[i], pair);
  }

  std::vector<FrontendRow> rows() const {
    std::vector<FrontendRow> all;
    all.reserve(tallies_.size());
    for (const Tally& tally : tallies_) all.push_back(row_of(tally));
    return all;
  }

 private:
  /// Index of a group's first tally.
  std::size_t group(const std::string& name) {
    const auto known = std::ranges::find(tallies_, name, &Tally::group);
    const auto index = static_cast<std::size_t>(known - tallies_.begin());
    if (known == tallies_.end()) {
      for (const NamedFrontend& one : named_) tallies_.push_back({.group = name, .frontend = one.name});
    }
    return index;
  }

  std::vector<NamedFrontend> named_;
  std::vector<Frontend> made_;
  std::vector<Tally> tallies_;
};

}  // namespace

std::vector<NamedFrontend> compared_frontends(int points, const std::vector<ModelFiles>& models) {
  const auto built_in = [points](const char* name) {
    return FrontendOptions{.extractor = name, .max_features = points};
  };
  FrontendOptions lunar = built_in("lunar");
  lunar.matcher = "lunar";
  std::vector<NamedFrontend> all{{"lunar + lunar", lunar},
                                 {"lunar + nearest", built_in("lunar")},
                                 {"classical + nearest", built_in("classical")},
                                 {"ORB + nearest", built_in("orb")},
                                 {"SIFT + nearest", built_in("sift")}};
  for (const ModelFiles& files : models) {
    FrontendOptions options{.extractor = "onnx", .extractor_model = files.extractor, .max_features = points};
    all.push_back({files.name + " + nearest", options});
    if (files.matcher.empty()) continue;
    options.matcher = "onnx";
    options.matcher_model = files.matcher;
    all.push_back({files.name + " + " + files.matcher_name, options});
  }
  return all;
}

double area_under_recall(const std::vector<double>& errors, double limit) {
  double sum = 0.0;
  for (const double error : errors) sum += std::max(0.0, 1.0 - error / limit);
  return percent(sum, static_cast<double>(errors.size()));
}

std::vector<FrontendRow> frontend_experiment(const FrontendExperiment& experiment, const Progress& progress) {
  Comparison comparison(experiment.frontends);
  const PairSink sink = [&](const ViewPair& pair) {
    comparison.add(pair);
    return !progress.stop_requested();
  };
  simulated_pairs(experiment.simulated, sink, progress);
  if (!experiment.data.empty()) real_pairs(experiment.data, experiment.calibration, experiment.real_pairs, sink);
  return comparison.rows();
}

}  // namespace demslam
