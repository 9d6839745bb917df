#include "demslam/features/vocabulary.h"

#include <algorithm>

#include "demslam/base/random.h"

namespace demslam {
namespace {

constexpr int kRounds = 12;  // of k-means

DescriptorRows stacked(const std::vector<const DescriptorRows*>& images) {
  Eigen::Index rows = 0, cols = 0;
  for (const DescriptorRows* image : images) {
    rows += image->rows();
    cols = std::max(cols, image->cols());
  }
  DescriptorRows all(rows, cols);
  Eigen::Index row = 0;
  for (const DescriptorRows* image : images) {
    all.middleRows(row, image->rows()) = *image;
    row += image->rows();
  }
  return all;
}

}  // namespace

Vocabulary Vocabulary::train(const std::vector<const DescriptorRows*>& images, int words, std::uint64_t seed) {
  const DescriptorRows all = stacked(images);
  Vocabulary vocabulary;
  Random random(seed);
  vocabulary.centres_.resize(std::min<Eigen::Index>(words, all.rows()), all.cols());
  for (auto centre : vocabulary.centres_.rowwise())
    centre = all.row(static_cast<Eigen::Index>(random.index(static_cast<std::uint64_t>(all.rows()))));
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<Eigen::Index> word_of = vocabulary.nearest(all);
    DescriptorRows sums = DescriptorRows::Zero(vocabulary.words(), all.cols());
    Eigen::VectorXf counts = Eigen::VectorXf::Zero(vocabulary.words());
    for (Eigen::Index row = 0; row < all.rows(); ++row) {
      sums.row(word_of[static_cast<std::size_t>(row)]) += all.row(row);
      counts[word_of[static_cast<std::size_t>(row)]] += 1.0F;
    }
    for (Eigen::Index word = 0; word < vocabulary.words(); ++word) {
      if (counts[word] > 0.0F) vocabulary.centres_.row(word) = sums.row(word) / counts[word];
    }
  }
  return vocabulary;
}

std::vector<Eigen::Index> Vocabulary::nearest(const DescriptorRows& descriptors) const {
  const Eigen::RowVectorXf half_norms = 0.5F * centres_.rowwise().squaredNorm().transpose();
  std::vector<Eigen::Index> words(static_cast<std::size_t>(descriptors.rows()));
  for (Eigen::Index row = 0; row < descriptors.rows(); ++row) {
    (descriptors.row(row) * centres_.transpose() - half_norms).maxCoeff(&words[static_cast<std::size_t>(row)]);
  }
  return words;
}

Eigen::VectorXf Vocabulary::describe(const DescriptorRows& descriptors) const {
  DescriptorRows sums = DescriptorRows::Zero(centres_.rows(), centres_.cols());
  const std::vector<Eigen::Index> word_of = nearest(descriptors);
  for (Eigen::Index row = 0; row < descriptors.rows(); ++row) {
    const Eigen::Index word = word_of[static_cast<std::size_t>(row)];
    sums.row(word) += descriptors.row(row) - centres_.row(word);
  }
  sums.rowwise().normalize();
  Eigen::VectorXf description = sums.reshaped<Eigen::RowMajor>();
  description.normalize();
  return description;
}

}  // namespace demslam
