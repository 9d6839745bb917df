#include "demslam/graph/factor_table.h"

#include <algorithm>
#include <limits>

namespace demslam {

void FactorTable::note(const Factor& factor, std::size_t keyframe) {
  for (const gtsam::Key key : factor->keys()) {
    if (!is_keyframe(key)) last_[key] = std::max(last_[key], keyframe);
  }
}

void FactorTable::add(const Factor& factor, std::size_t oldest_keyframe) {
  rows_.at(oldest_keyframe).factors.push_back(factor);
  note(factor, oldest_keyframe);
}

void FactorTable::keep(gtsam::Key key) { last_[key] = std::numeric_limits<std::size_t>::max(); }

void FactorTable::remove(const Factor& factor, std::size_t oldest_keyframe) {
  std::erase(rows_.at(oldest_keyframe).factors, factor);
}

void FactorTable::set_link(const Factor& factor, std::size_t keyframe) {
  rows_.at(keyframe).link = factor;
  if (factor) note(factor, keyframe);
}

void FactorTable::append_to(gtsam::NonlinearFactorGraph& graph, std::size_t begin, std::size_t end) const {
  for (std::size_t k = begin; k < std::min(end, rows_.size()); ++k) {
    for (const Factor& factor : rows_[k].factors) graph.push_back(factor);
    if (rows_[k].link) graph.push_back(rows_[k].link);
  }
}

bool FactorTable::needed_from(gtsam::Key key, std::size_t begin) const {
  if (is_keyframe(key)) return key >= begin;
  const auto last = last_.find(key);
  return last != last_.end() && last->second >= begin;
}

}  // namespace demslam
