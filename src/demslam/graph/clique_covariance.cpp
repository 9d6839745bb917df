#include "demslam/graph/clique_covariance.h"

#include <gtsam/linear/GaussianConditional.h>

#include <memory>
#include <utility>
#include <vector>

#include "demslam/graph/elimination_order.h"

namespace demslam {

void CliqueCovariance::lay_out(const gtsam::GaussianConditional& conditional) {
  Eigen::Index end = 0;
  for (auto variable = conditional.begin(); variable != conditional.end(); ++variable) {
    const Eigen::Index size = conditional.getDim(variable);
    begin_[*variable] = {end, size};
    end += size;
  }
  covariance_ = gtsam::Matrix::Zero(end, end);
}

gtsam::Matrix CliqueCovariance::block(gtsam::Key a, gtsam::Key b) const {
  const Range &rows = begin_.at(a), &cols = begin_.at(b);
  return covariance_.block(rows.begin, cols.begin, rows.size, cols.size);
}

CliqueCovariance::CliqueCovariance(const gtsam::GaussianConditional& conditional) {
  lay_out(conditional);
  const gtsam::Matrix R = conditional.R();
  const gtsam::Matrix R_inverse = R.triangularView<Eigen::Upper>().solve(gtsam::Matrix::Identity(R.rows(), R.cols()));
  covariance_.topLeftCorner(R.rows(), R.cols()) = R_inverse * R_inverse.transpose();
}

/// x_frontal = R^-1 (d - S x_separator) + noise of covariance (R^T R)^-1.
CliqueCovariance::CliqueCovariance(const gtsam::GaussianConditional& conditional, const CliqueCovariance& parent)
    : CliqueCovariance(conditional) {
  const Eigen::Index frontal = conditional.R().rows(), separator = covariance_.rows() - frontal;
  for (auto a = conditional.beginParents(); a != conditional.endParents(); ++a) {
    for (auto b = conditional.beginParents(); b != conditional.endParents(); ++b) {
      const Range &rows = begin_.at(*a), &cols = begin_.at(*b);
      covariance_.block(rows.begin, cols.begin, rows.size, cols.size) = parent.block(*a, *b);
    }
  }
  const gtsam::Matrix gain =
      -gtsam::Matrix(conditional.R()).triangularView<Eigen::Upper>().solve(gtsam::Matrix(conditional.S()));
  const gtsam::Matrix of_separator = covariance_.bottomRightCorner(separator, separator);
  const gtsam::Matrix cross = gain * of_separator;
  covariance_.topRightCorner(frontal, separator) = cross;
  covariance_.bottomLeftCorner(separator, frontal) = cross.transpose();
  covariance_.topLeftCorner(frontal, frontal) += cross * gain.transpose();
}

gtsam::GaussianBayesTree::shared_ptr eliminated(const gtsam::GaussianFactorGraph& graph) {
  return graph.eliminateMultifrontal(nested_dissection(graph));
}

void for_each_clique(const gtsam::GaussianBayesTree& tree,
                     const std::function<void(const gtsam::GaussianConditional&, const CliqueCovariance&)>& visit) {
  using Clique = gtsam::GaussianBayesTree::sharedClique;
  std::vector<std::pair<Clique, std::shared_ptr<const CliqueCovariance>>> open;  // a clique and its parent's covariance
  for (const Clique& root : tree.roots()) open.emplace_back(root, nullptr);
  while (!open.empty()) {
    const auto [clique, parent] = open.back();
    open.pop_back();
    const gtsam::GaussianConditional& conditional = *clique->conditional();
    const auto covariance = parent ? std::make_shared<const CliqueCovariance>(conditional, *parent)
                                   : std::make_shared<const CliqueCovariance>(conditional);
    visit(conditional, *covariance);
    for (const Clique& child : clique->children) open.emplace_back(child, covariance);
  }
}

}  // namespace demslam
