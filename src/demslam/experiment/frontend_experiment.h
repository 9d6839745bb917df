#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "demslam/evaluation/table.h"
#include "demslam/experiment/view_pairs.h"
#include "demslam/features/frontend.h"

namespace demslam {

/// One row of every group of pairs.
struct NamedFrontend {
  std::string name;
  FrontendOptions options;
};

/// ONNX files of an extractor and, unless empty, of a matcher for it.
struct ModelFiles {
  std::string name;
  std::filesystem::path extractor, matcher;
  std::string matcher_name = "its matcher";
};

/// lunar with its own matcher; lunar, classical, ORB and SIFT with nearest neighbours; each with `points` keypoints at
/// most. Of every one of `models`: with its matcher and with nearest neighbours.
std::vector<NamedFrontend> compared_frontends(int points, const std::vector<ModelFiles>& models);

struct FrontendExperiment {
  std::vector<NamedFrontend> frontends;
  SimulatedPairs simulated;
  std::filesystem::path data;         ///< folder with real sequences; empty: none
  std::filesystem::path calibration;  ///< of rover_sandbox
  int real_pairs = 10;                ///< per sequence
};

/// What one front-end did on one group of pairs; counts are means per pair.
struct FrontendRow {
  std::string group, frontend;
  int pairs = 0;
  double points = 0.0, matches = 0.0;
  double right = 0.0;      ///< matches within 3 px of where the truth (without one: the motion found) puts the point
  double right_95 = 0.0;   ///< half the 95 % confidence interval of that mean over the pairs
  double precision = 0.0;  ///< right ones of those whose depth is known, percent
  double on_row = 0.0;     ///< left-right matches on one row within 1.5 px, percent
  bool has_truth = true;   ///< else the AUCs, `recall` and `wrong` say nothing
  double angle_auc[3] = {}, offset_auc[3] = {};  ///< of the motion, at kAngles_deg and kOffsets_m, percent
  double recall = 0.0;  ///< motions found within 5 degrees and 10 cm, percent: what a loop closure needs
  int wrong = 0;        ///< motions accepted, but not within these
  int failed = 0;       ///< no motion was accepted
  double extract_ms = 0.0, match_ms = 0.0;  ///< processor time of all threads, per image and per pair of images
};
inline constexpr double kAngles_deg[] = {1.0, 3.0, 5.0}, kOffsets_m[] = {0.02, 0.05, 0.10};

/// Every front-end on every pair: matching, then the motion by the product's own P3P and refinement.
std::vector<FrontendRow> frontend_experiment(const FrontendExperiment& experiment, const Progress& progress = {});
Table frontend_table(const std::vector<FrontendRow>& rows);
std::string frontend_json(const std::vector<FrontendRow>& rows);

/// Area under the curve of recall over error from 0 to `limit`, percent; failures are infinite errors.
double area_under_recall(const std::vector<double>& errors, double limit);

}  // namespace demslam
