#include "demslam/odometry/ransac.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "demslam/base/random.h"

namespace demslam {
namespace {

constexpr double kConfidence = 0.9999;
constexpr double kMinDepthM = 1e-3;

/// Squared error in view b, pixels^2; infinite behind the camera.
double squared_error(const RectifiedRig& rig, const Eigen::Matrix3d& R_b_a, const Eigen::Vector3d& t_b_a,
                     const Eigen::Vector3d& p_a, const StereoPixel& b) {
  const Eigen::Vector3d p_b = R_b_a * p_a + t_b_a;
  if (p_b.z() < kMinDepthM) return std::numeric_limits<double>::infinity();
  const StereoPixel error = b - project(rig, p_b);
  return has_disparity(b) ? error.squaredNorm() : error.head<2>().squaredNorm();
}

/// Everything one search works on.
class PoseSearch {
 public:
  PoseSearch(const RectifiedRig& rig, const std::vector<Correspondence>& correspondences, const RansacOptions& options)
      : rig_(rig), correspondences_(correspondences), options_(options) {
    for (const Correspondence& c : correspondences) points_a_.push_back(unproject(rig, c.a));
  }

  struct Score {
    double cost = std::numeric_limits<double>::infinity();
    int inliers = 0;
  };

  Score score(const Pose& T_a_b) const {
    const Pose T_b_a = T_a_b.inverse();
    const Eigen::Matrix3d R_b_a = T_b_a.rotation_matrix();
    const double limit = options_.threshold_px * options_.threshold_px;
    Score result{.cost = 0.0};
    for (std::size_t i = 0; i < points_a_.size(); ++i) {
      const double error = squared_error(rig_, R_b_a, T_b_a.translation(), points_a_[i], correspondences_[i].b);
      result.cost += std::min(error, limit);
      result.inliers += error < limit ? 1 : 0;
    }
    return result;
  }

  /// P3P on the first three of the sample; the fourth picks among its solutions.
  std::optional<Pose> solve(const std::array<std::size_t, 4>& sample) const {
    std::vector<cv::Point3d> points;
    std::vector<cv::Point2d> rays;
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d& p = points_a_[sample[i]];
      const StereoPixel& b = correspondences_[sample[i]].b;
      points.emplace_back(p.x(), p.y(), p.z());
      rays.emplace_back((b.x() - rig_.cx) / rig_.focal_px, (b.y() - rig_.cy) / rig_.focal_px);
    }
    std::vector<cv::Mat> rotations, translations;
    cv::solveP3P(points, rays, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), rotations, translations, cv::SOLVEPNP_AP3P);
    return best_solution(rotations, translations, sample[3]);
  }

 private:
  std::optional<Pose> best_solution(const std::vector<cv::Mat>& rotations, const std::vector<cv::Mat>& translations,
                                    std::size_t judge) const {
    std::optional<Pose> best;
    double best_error = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < rotations.size(); ++k) {
      const cv::Vec3d r(rotations[k]), t(translations[k]);
      Vector6d twist = Vector6d::Zero();
      twist.head<3>() << r[0], r[1], r[2];
      const Pose T_b_a(Pose::exp(twist).rotation(), {t[0], t[1], t[2]});
      const double error = squared_error(rig_, T_b_a.rotation_matrix(), T_b_a.translation(), points_a_[judge],
                                         correspondences_[judge].b);
      if (!(error < best_error)) continue;
      best_error = error;
      best = T_b_a.inverse();
    }
    return best;
  }

  const RectifiedRig& rig_;
  const std::vector<Correspondence>& correspondences_;
  const RansacOptions& options_;
  std::vector<Eigen::Vector3d> points_a_;
};

std::array<std::size_t, 4> draw_sample(Random& random, std::size_t count) {
  std::array<std::size_t, 4> sample{};
  for (std::size_t i = 0; i < sample.size();) {
    sample[i] = random.index(count);
    if (std::find(sample.begin(), sample.begin() + i, sample[i]) == sample.begin() + i) ++i;
  }
  return sample;
}

/// Draws after which a sample without outliers has been seen with near certainty.
int draws_needed(double inlier_ratio, int at_most) {
  const double good_sample = std::pow(inlier_ratio, 4);
  if (good_sample < 1e-9) return at_most;
  if (good_sample > 1.0 - 1e-9) return 1;
  const double draws = std::log(1.0 - kConfidence) / std::log(1.0 - good_sample);
  return draws < at_most ? static_cast<int>(std::ceil(draws)) : at_most;
}

}  // namespace

std::optional<Pose> find_pose(const RectifiedRig& rig, const std::vector<Correspondence>& correspondences,
                              const RansacOptions& options, const Pose* guess_T_a_b) {
  if (static_cast<int>(correspondences.size()) < std::max(4, options.min_inliers)) return std::nullopt;
  const PoseSearch search(rig, correspondences, options);
  Random random(options.seed, correspondences.size());
  std::optional<Pose> best;
  PoseSearch::Score best_score;
  const auto consider = [&](const std::optional<Pose>& T_a_b) {
    if (!T_a_b) return;
    const PoseSearch::Score score = search.score(*T_a_b);
    if (score.cost < best_score.cost) best = T_a_b, best_score = score;
  };
  if (guess_T_a_b) consider(*guess_T_a_b);
  const double count = static_cast<double>(correspondences.size());
  for (int i = 0; i < draws_needed(best_score.inliers / count, options.iterations); ++i) {
    consider(search.solve(draw_sample(random, correspondences.size())));
  }
  if (best_score.inliers < options.min_inliers) return std::nullopt;
  return best;
}

}  // namespace demslam
