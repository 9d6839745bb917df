#pragma once

#include <boost/shared_ptr.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <vector>

#include "demslam/geometry/pose.h"
#include "demslam/graph/factor_residual.h"

namespace demslam {

/// Relative-pose measurement between two keyframes, with the covariance of its right perturbation (rotation,
/// translation).
struct RelativePose {
  std::size_t i = 0, j = 0;
  Pose T_i_j;
  Matrix6d covariance = Matrix6d::Identity();
};

/// Systematic errors of the odometry as states: one per stretch of path, a random walk from stretch to stretch.
struct SystematicOptions {
  bool enabled = false;
  double scale_sigma = 0.0025;              ///< prior of the relative scale error: a bar of aluminium over 100 degrees
  double rotation_sigma_deg_per_m = 0.002;  ///< prior of the rotation bias, per body axis
  double stretch_m = 200.0;                 ///< length of path that shares one state
  double scale_walk_per_sqrt_km = 0.002;    ///< growth of the scale's uncertainty along the path
  double rotation_walk_deg_per_m_per_sqrt_km = 0.0007;
};

/// The graph's estimate of the systematic errors where a keyframe is.
struct SystematicErrors {
  double scale = 0.0;                                            ///< true length / measured length = exp(scale)
  Eigen::Vector3d rotation_rad_per_m = Eigen::Vector3d::Zero();  ///< body axes
};

struct PoseGraphOptions {
  SystematicOptions systematic;
  double loop_kernel_sigmas = 3.0;  ///< Cauchy width of loop closures, on the norm of the whitened six-vector
  double loop_gate = 22.46;         ///< chi-square (6 degrees of freedom, 99.9 %) against the rest of the graph
                                    ///< beyond which a batch switches a loop off
  double window_m = 100.0;          ///< path that optimize_recent() keeps in play
  double batch_every = 0.03;        ///< path between two batches in the run, as a share of the path so far
  double batch_takes = 0.005;       ///< path from a batch's beginning until its result counts, as such a share
  int max_iterations = 100;
};

struct OptimizerReport {
  double error_before = 0.0, error_after = 0.0;
  int iterations = 0;
  std::size_t factors = 0, variables = 0;  ///< in the problem solved
  bool batch = false;                      ///< everything may have moved
  int loops_switched = 0;                  ///< off, or on again
  double milliseconds = 0.0;
  double waited_ms = 0.0;     ///< of them, until the thread of the batch was ready
  double batch_cpu_ms = 0.0;  ///< processor time of that thread
};

/// Begins a batch somewhere, and tells when it is done.
using BatchLauncher = std::function<std::future<void>(std::function<void()> batch)>;
std::future<void> in_its_own_thread(std::function<void()> batch);

/// Keyframe poses T_map_body and the factors between and on them; Levenberg-Marquardt (GTSAM, METIS ordering).
/// Loop and unary factors carry robust kernels of their own; a factor knows its keyframes by index (gtsam::Key ==
/// index). Same calls, same bytes, whatever the number of threads and however fast each of them is.
///
/// For the long run: optimize_window() or optimize_recent() while driving, at a cost that does not grow. What leaves
/// the window is condensed for the window's sake, and folded for the batch's: of the keyframes behind it only those
/// that carry more than odometry stay variables, the others follow from them. Nothing is lost: a factor on a folded
/// keyframe makes it a variable again.
///
/// Batches in the run are solved beside it, over a copy of the graph. When their result counts follows from the path
/// alone, not from when they are done: the run waits for them if it must.
class PoseGraph {
 public:
  explicit PoseGraph(const PoseGraphOptions& options = {}, BatchLauncher launch = in_its_own_thread);
  ~PoseGraph();  ///< waits for a batch under way
  PoseGraph(PoseGraph&&) noexcept;

  /// Adds keyframe `size()` at an initial estimate and returns its index.
  std::size_t add_keyframe(const Pose& T_map_body);
  void add_prior(std::size_t keyframe, const Pose& T_map_body, const Matrix6d& covariance);
  void add_odometry(const RelativePose& measurement);
  /// One loop closure and its index: measurements that are right or wrong together (their place is taken for another),
  /// each with a Cauchy kernel. i < j.
  std::size_t add_loop(std::vector<RelativePose> measurements);
  std::size_t add_loop(const RelativePose& measurement) { return add_loop(std::vector{measurement}); }
  void add_factor(const boost::shared_ptr<gtsam::NonlinearFactor>& factor);

  /// A three-vector that factors of any keyframe may share (a DEM's shift), with a zero-mean prior of these standard
  /// deviations. Returns its key.
  std::uint64_t add_shared(const Eigen::Vector3d& sigma);
  /// T_map_body := T_correction * T_map_body from keyframe `first` on: a better place to begin the next optimize(). A
  /// batch under way is dropped, which knows nothing of it.
  void move(std::size_t first, const Pose& T_correction);

  /// All keyframes in batch, from the result of the batch under way if there is one. Throws Error when a keyframe is
  /// tied to nothing (no prior, no odometry). Loops that contradict the others are switched off, by graduated
  /// non-convexity over all loops ever added where they contradict each other grossly, then one by one against all the
  /// rest; one switched off earlier may come back.
  OptimizerReport optimize();
  /// Keyframes from `first` on, at a cost that depends on their number only: what is older is condensed, once, into a
  /// Gaussian on the window's boundary, and keeps its estimate. Factors added later to older keyframes (loop closures)
  /// wait for optimize(), which puts everything in play again. `first` may only grow between two calls of optimize().
  OptimizerReport optimize_window(std::size_t first);
  /// The solver of the run: the window. Begins a batch where a loop that waits would move the estimate and the path has
  /// grown enough since the last one that batches stay cheap per keyframe. Once the path has grown by
  /// options.batch_takes since, by a keyframe at least, its result counts: what the graph held then is where the batch
  /// has it, later keyframes move along with the newest one of then, and the window reaches back to there for once.
  OptimizerReport optimize_recent();
  /// True when the next optimize_recent() will move everything to where a batch has it.
  bool batch_is_ready() const;

  std::size_t size() const;
  std::size_t variables() const;  ///< keyframes that are not folded, and systematic states
  std::size_t loops() const;      ///< all that were added
  bool loop_is_on(std::size_t loop) const;
  std::size_t batches() const;                ///< how often everything may have moved
  double path_m(std::size_t keyframe) const;  ///< measured by odometry, since keyframe 0
  const Pose& T_map_body(std::size_t keyframe) const;
  Eigen::Vector3d shared(std::uint64_t key) const;
  Eigen::Matrix3d shared_covariance(std::uint64_t key) const;  ///< one pass over the whole graph
  /// All zero when systematic states are off.
  SystematicErrors systematic_errors(std::size_t keyframe) const;
  /// The odometry's measurement with the present estimate of its systematic errors taken out.
  Pose corrected_odometry(const RelativePose& measurement) const;
  /// Marginal covariance of the right perturbation, for each asked keyframe, at the present estimate: one pass over the
  /// whole graph, however many are asked for.
  std::vector<Matrix6d> covariances(const std::vector<std::size_t>& keyframes) const;
  /// The same for the newest keyframe, from the last window and the odometry since, without solving anything.
  Matrix6d newest_covariance() const;
  /// Covariance of the right perturbation of the graph's own T_i_j, i < j, without solving anything: an upper bound, by
  /// odometry alone or by what was known of either pose when it was the newest, whichever is smaller.
  Matrix6d relative_covariance(std::size_t i, std::size_t j) const;
  /// Covariance of T_i_j by odometry alone, i < j; nothing where a link of the chain is missing.
  std::optional<Matrix6d> odometry_covariance(std::size_t i, std::size_t j) const;
  /// What odometry's errors do to keyframes a to b as a whole, seen from m: OdometryChain::bend().
  std::optional<Matrix6d> odometry_bend(std::size_t a, std::size_t m, std::size_t b) const;
  /// Chi-square distance (6 degrees of freedom) of a measurement from the graph's own prediction, both covariances
  /// included.
  double chi_square(const RelativePose& measurement) const;
  /// The same from odometry alone, which no loop can have misled; nothing where a link of the chain is missing.
  std::optional<double> odometry_chi_square(const RelativePose& measurement) const;
  /// Of every active factor that `kind_of` names, in the order of keyframes; of odometry and loops see chi_square().
  std::vector<FactorResidual> residuals(const FactorKindOf& kind_of) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace demslam
