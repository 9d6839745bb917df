#pragma once

#include <gtsam/linear/GaussianBayesTree.h>
#include <gtsam/linear/GaussianFactorGraph.h>

#include <functional>
#include <map>

namespace demslam {

/// The joint covariance of the variables of one clique of a Bayes tree.
class CliqueCovariance {
 public:
  /// Of a root.
  explicit CliqueCovariance(const gtsam::GaussianConditional& conditional);
  /// Of a child whose separator lies in `parent`.
  CliqueCovariance(const gtsam::GaussianConditional& conditional, const CliqueCovariance& parent);

  bool holds(gtsam::Key key) const { return begin_.contains(key); }
  /// Rows of `a`, columns of `b`.
  gtsam::Matrix block(gtsam::Key a, gtsam::Key b) const;

 private:
  void lay_out(const gtsam::GaussianConditional& conditional);

  struct Range {
    Eigen::Index begin = 0, size = 0;
  };
  std::map<gtsam::Key, Range> begin_;
  gtsam::Matrix covariance_;
};

/// As a Bayes tree, in nested-dissection order.
gtsam::GaussianBayesTree::shared_ptr eliminated(const gtsam::GaussianFactorGraph& graph);

/// Visits every clique from the roots down, each with its joint covariance: all marginals, and those of all variables
/// that share a factor, in one pass that is linear in the number of cliques.
void for_each_clique(const gtsam::GaussianBayesTree& tree,
                     const std::function<void(const gtsam::GaussianConditional&, const CliqueCovariance&)>& visit);

}  // namespace demslam
