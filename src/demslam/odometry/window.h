#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <vector>

#include "demslam/odometry/archive.h"
#include "demslam/odometry/bundle.h"
#include "demslam/odometry/direct_match.h"

namespace demslam {

/// The last few keyframes, and landmarks seen from several of them. A landmark is hosted by the keyframe whose keypoint
/// it is and is found in later keyframes by aligning the host's patch, so that nothing drifts from keyframe to keyframe
/// while the host is in the window. Each new keyframe triggers a stereo bundle adjustment; the oldest keyframe is held
/// fixed.
class Window {
 public:
  Window(const MotionOptions& options, int keyframes) : options_(options), capacity_(keyframes) {}

  /// Forgets everything and starts from one keyframe.
  void restart(const StereoView& view);

  /// Adds a keyframe at its pose in the newest one and adjusts the window. Gives the refined pose and its covariance;
  /// none, and a restart from the new keyframe, if too few landmarks are seen in it. The rig has the vergence
  /// as it is known; `vergence` says how well, and is told what the window has learned.
  std::optional<Motion> add(const RectifiedRig& rig, const StereoView& view, const Pose& T_newest_left,
                            Vergence& vergence);

  /// The state but for the views' features and images: those are visited after reading.
  template <class Archive>
  friend void archive(Archive& io, Window& w) {
    io(w.next_id_, w.members_);
  }
  void for_each_view(const std::function<void(StereoView&)>& visit) {
    for (Member& member : members_) visit(member.view);
  }

 private:
  struct Sighting {
    std::size_t member = 0;
    DirectSighting seen;

    template <class Archive>
    friend void archive(Archive& io, Sighting& s) {
      io(s.member, s.seen.pixel, s.seen.covariance);
    }
  };
  struct Landmark {
    PatchPoint point;
    double disparity_px = 0.0;  ///< in its host, as refined
    std::vector<Sighting> sightings;
    bool in_sight = true;  ///< found in the newest keyframe when last looked for

    template <class Archive>
    friend void archive(Archive& io, Landmark& l) {
      io(l.point, l.disparity_px, l.sightings, l.in_sight);
    }
  };
  struct Member {
    std::size_t id = 0;
    StereoView view;
    Pose T_world_left;
    std::vector<Landmark> landmarks;

    template <class Archive>
    friend void archive(Archive& io, Member& m) {
      io(m.id, m.view, m.T_world_left, m.landmarks);
    }
  };

  Member make_member(const StereoView& view, const Pose& T_world_left);
  int sight_landmarks(const RectifiedRig& rig, const Member& newest);
  Bundle make_bundle(const Vergence& vergence) const;
  void take_over(const Bundle& bundle, const BundleReport& report);

  MotionOptions options_;
  int capacity_;
  std::size_t next_id_ = 0;
  std::deque<Member> members_;
};

}  // namespace demslam
