#include "demslam/features/global_descriptor.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

#include "demslam/base/random.h"
#include "demslam/features/similarity.h"

namespace demslam {
namespace {

constexpr std::uint64_t kSeed = 32;
constexpr int kIterations = 10;
constexpr double kUnit = 0x1.0p20;  // residuals are summed in integers, whose order does not matter
constexpr double kLargestByte = 127.0;

using Sums = Eigen::Matrix<std::int64_t, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Rows view(const DescriptorRows& rows) {
  return {rows.data(), static_cast<std::size_t>(rows.rows()), static_cast<std::size_t>(rows.cols())};
}

std::int64_t fixed_point(float value) { return std::lrint(kUnit * static_cast<double>(value)); }

/// Each word's sum of the rows nearest to it, in units of 1 / kUnit, and how many these are.
struct WordSums {
  Sums sum;
  Eigen::Matrix<std::int64_t, Eigen::Dynamic, 1> count;
};

WordSums sum_by_word(const DescriptorRows& rows, const DescriptorRows& words) {
  WordSums sums{Sums::Zero(words.rows(), words.cols()),
                Eigen::Matrix<std::int64_t, Eigen::Dynamic, 1>::Zero(words.rows())};
  const MutualBest best = best_products(view(rows), view(words));
  for (Eigen::Index r = 0; r < rows.rows(); ++r) {
    const Eigen::Index word = best.of_query[static_cast<std::size_t>(r)].index;
    sums.sum.row(word) += rows.row(r).unaryExpr(&fixed_point);
    ++sums.count[word];
  }
  return sums;
}

DescriptorRows draw_words(const DescriptorRows& examples, Eigen::Index count) {
  assert(examples.rows() > 0);
  Random random(kSeed);
  DescriptorRows words(count, examples.cols());
  for (Eigen::Index k = 0; k < count; ++k) {
    words.row(k) = examples.row(static_cast<Eigen::Index>(random.index(static_cast<std::uint64_t>(examples.rows()))));
  }
  return words;
}

DescriptorRows learn_words(const DescriptorRows& examples, Eigen::Index count) {
  DescriptorRows words = draw_words(examples, count);
  for (int i = 0; i < kIterations; ++i) {
    const WordSums sums = sum_by_word(examples, words);
    for (Eigen::Index k = 0; k < count; ++k) {
      const Eigen::RowVectorXf sum = sums.sum.row(k).cast<float>();
      if (const float length = sum.norm(); length > 0.0F) words.row(k) = sum / length;
    }
  }
  return words;
}

/// The word itself where no row is nearest to it.
DescriptorRows means_by_word(const DescriptorRows& rows, const DescriptorRows& words) {
  const WordSums sums = sum_by_word(rows, words);
  DescriptorRows means = words;
  for (Eigen::Index k = 0; k < words.rows(); ++k) {
    if (sums.count[k] == 0) continue;
    means.row(k) = (sums.sum.row(k).cast<double>() / (kUnit * static_cast<double>(sums.count[k]))).cast<float>();
  }
  return means;
}

DescriptorRows random_signs(Eigen::Index rows, Eigen::Index cols) {
  Random random(kSeed, 1);
  return DescriptorRows::NullaryExpr(rows, cols, [&] { return (random.next() >> 63) != 0 ? 1.0F : -1.0F; });
}

/// Where a word's descriptors lie around their mean elsewhere, by the direction alone: how many there are counts for
/// nothing.
Eigen::VectorXf vlad(const DescriptorRows& rows, const DescriptorRows& words, const DescriptorRows& means) {
  const WordSums sums = sum_by_word(rows, words);
  Eigen::VectorXf all(words.size());
  for (Eigen::Index k = 0; k < words.rows(); ++k) {
    const Eigen::Matrix<std::int64_t, 1, Eigen::Dynamic> residual =
        sums.sum.row(k) - sums.count[k] * means.row(k).unaryExpr(&fixed_point);
    const Eigen::RowVectorXf direction = residual.cast<float>();
    const float length = direction.norm();
    all.segment(k * words.cols(), words.cols()) = direction.transpose() / std::max(length, 1.0F);
  }
  return all.array().sign() * all.array().abs().sqrt();
}

/// The largest component becomes 127.
GlobalDescriptor to_bytes(const Eigen::VectorXf& values) {
  GlobalDescriptor bytes{};
  const double largest = values.cwiseAbs().maxCoeff();
  if (largest <= 0.0) return bytes;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = static_cast<std::int8_t>(std::lrint(kLargestByte / largest * values[static_cast<Eigen::Index>(i)]));
  }
  return bytes;
}

int product(const GlobalDescriptor& a, const GlobalDescriptor& b) {
  int sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += static_cast<int>(a[i]) * static_cast<int>(b[i]);
  return sum;
}

}  // namespace

double similarity(const GlobalDescriptor& a, const GlobalDescriptor& b) {
  const double squares = static_cast<double>(product(a, a)) * static_cast<double>(product(b, b));
  return squares > 0.0 ? product(a, b) / std::sqrt(squares) : 0.0;
}

GlobalDescriber::GlobalDescriber(const DescriptorRows& examples)
    : words_(learn_words(examples, kWords)), means_(means_by_word(examples, words_)) {
  projection_ = random_signs(static_cast<Eigen::Index>(GlobalDescriptor{}.size()), words_.size());
}

GlobalDescriptor GlobalDescriber::describe(const DescriptorRows& rows) const {
  if (rows.rows() == 0) return {};
  assert(rows.cols() == words_.cols());
  return to_bytes(projection_ * vlad(rows, words_, means_));
}

}  // namespace demslam
