// How often the places that look most like a view are its place: recall of loop closure's candidates by appearance,
// against the truth, each frame taken for a keyframe. A place is true within 3 m and 30 degrees.
// Usage: appearance_recall DATASET [EXTRACTOR]
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <numbers>
#include <vector>

#include "demslam/dataset/sequence.h"
#include "demslam/evaluation/trajectory_io.h"
#include "demslam/features/frontend.h"
#include "demslam/graph/appearance.h"

using namespace demslam;

namespace {

constexpr double kNear_m = 3.0, kNear_rad = 30.0 * std::numbers::pi / 180.0, kMinPath_m = 30.0;
constexpr std::size_t kCandidates = 3;

struct Drive {
  Trajectory poses;
  std::vector<std::shared_ptr<const StereoFeatures>> views;
  std::vector<double> path_m;
};

Drive read(const std::filesystem::path& dataset, const std::string& extractor) {
  const auto sequence = open_dataset(dataset);
  const Frontend frontend = make_frontend({.extractor = extractor});
  Drive drive{.poses = read_trajectory(dataset / "gt.txt").poses};
  for (std::size_t i = 0; i < std::min(sequence->size(), drive.poses.size()); ++i) {
    auto view = std::make_shared<StereoFeatures>();
    view->left = frontend.extractor->extract(sequence->frame(i).left);
    drive.views.push_back(std::move(view));
    const auto position = [&](std::size_t k) { return drive.poses[k].pose.translation(); };
    drive.path_m.push_back(i == 0 ? 0.0 : drive.path_m.back() + (position(i) - position(i - 1)).norm());
  }
  return drive;
}

bool same_place(const Pose& a, const Pose& b) {
  const Pose T_a_b = a.inverse() * b;
  return T_a_b.translation().norm() <= kNear_m && T_a_b.log().head<3>().norm() <= kNear_rad;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 1;
  const Drive drive = read(argv[1], argc > 2 ? argv[2] : "classical");
  Appearance appearance([&](std::size_t k) { return drive.views[k]; });
  int queries = 0, first = 0, any = 0, candidates = 0, right = 0;
  double chance = 0.0;
  for (std::size_t k = 0, end = 0; k < drive.views.size(); ++k) {
    while (drive.path_m[k] - drive.path_m[end] >= kMinPath_m) ++end;
    const auto is_right = [&](std::size_t i) { return same_place(drive.poses[k].pose, drive.poses[i].pose); };
    int places = 0;
    for (std::size_t i = 0; i < end; ++i) places += is_right(i);
    if (places == 0) continue;
    const std::vector<std::size_t> found = appearance.like(k, end, kCandidates);
    const auto hits = std::ranges::count_if(found, is_right);
    ++queries;
    first += !found.empty() && is_right(found.front());
    any += hits > 0;
    candidates += static_cast<int>(found.size());
    right += static_cast<int>(hits);
    chance += static_cast<double>(places) / static_cast<double>(end);
  }
  fmt::print(
      "{} frames, {} at a place seen before: recall@1 {:.1f} %, recall@{} {:.1f} %, {:.1f} % of the candidates "
      "right (at random {:.1f} %)\n",
      drive.views.size(), queries, 100.0 * first / queries, kCandidates, 100.0 * any / queries,
      100.0 * right / candidates, 100.0 * chance / queries);
}
