#pragma once

#include <gtsam/inference/Symbol.h>
#include <gtsam/nonlinear/NonlinearFactorGraph.h>

#include <unordered_map>
#include <vector>

namespace demslam {

/// Keyframes are their own index; every other variable is a gtsam::Symbol.
inline bool is_keyframe(gtsam::Key key) { return gtsam::Symbol(key).chr() == 0; }

/// The factors of a pose graph, each under the oldest keyframe it speaks of, so that a stretch of path can be taken
/// out.
class FactorTable {
 public:
  using Factor = gtsam::NonlinearFactor::shared_ptr;

  void add_keyframe() { rows_.emplace_back(); }
  void add(const Factor& factor, std::size_t oldest_keyframe);
  void remove(const Factor& factor, std::size_t oldest_keyframe);
  /// Factors of any later keyframe may speak of this variable.
  void keep(gtsam::Key key);
  /// The odometry that leaves a keyframe, compounded or not; null where there is none.
  void set_link(const Factor& factor, std::size_t keyframe);

  std::size_t size() const { return rows_.size(); }
  /// Those under one keyframe, without its link.
  const std::vector<Factor>& of(std::size_t keyframe) const { return rows_.at(keyframe).factors; }
  /// Those under the keyframes begin <= k < end.
  void append_to(gtsam::NonlinearFactorGraph& graph, std::size_t begin, std::size_t end) const;
  /// Does a factor under keyframe `begin` or later speak of this variable, or may one come that does?
  bool needed_from(gtsam::Key key, std::size_t begin) const;

 private:
  struct Row {
    std::vector<Factor> factors;
    Factor link;
  };
  void note(const Factor& factor, std::size_t keyframe);

  std::vector<Row> rows_;
  std::unordered_map<gtsam::Key, std::size_t> last_;  ///< per variable that is no keyframe: its last row
};

}  // namespace demslam
