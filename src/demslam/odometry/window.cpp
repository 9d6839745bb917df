#include "demslam/odometry/window.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

namespace demslam {

Window::Member Window::make_member(const StereoView& view, const Pose& T_world_left) {
  Member member{.id = next_id_++, .view = view, .T_world_left = T_world_left};
  for (std::size_t i = 0; i < view.features->left.size(); ++i) {
    if (!view.features->has_depth(i)) continue;
    const PatchPoint point{view.features->stereo_pixel(i), view.features->disparity_slope[i]};
    member.landmarks.push_back({.point = point, .disparity_px = point.pixel.z()});
  }
  return member;
}

void Window::restart(const StereoView& view) {
  members_.clear();
  members_.push_back(make_member(view, Pose()));
}

std::optional<Motion> Window::add(const RectifiedRig& rig, const StereoView& view, const Pose& T_newest_left,
                                  Vergence& vergence) {
  Member newest = make_member(view, members_.back().T_world_left * T_newest_left);
  const int sighted = sight_landmarks(rig, newest);
  if (sighted < options_.min_inliers) {
    restart(view);
    return std::nullopt;
  }
  members_.push_back(std::move(newest));
  Bundle bundle = make_bundle(vergence);
  const BundleReport report = optimize_bundle(rig, aligned_noise(rig, options_), bundle);
  if (!report.ok) {
    restart(view);
    return std::nullopt;
  }
  take_over(bundle, report);
  vergence = learned(vergence, report.vergence, 1.0 / capacity_);
  const int last = static_cast<int>(bundle.T_world_left.size()) - 1;
  Motion motion{.ok = true,
                .T_a_b = bundle.T_world_left[last - 1].inverse() * bundle.T_world_left[last],
                .covariance = relative_covariance(bundle, report, last - 1, last),
                .matches = static_cast<int>(report.inlier.size()),
                .inliers = report.inliers,
                .rms_px = report.rms_px};
  if (static_cast<int>(members_.size()) > capacity_) members_.pop_front();
  return motion;
}

/// Looks for every landmark still in sight in a new keyframe; returns how many were found.
int Window::sight_landmarks(const RectifiedRig& rig, const Member& newest) {
  int found = 0;
  for (Member& host : members_) {
    const Pose T_newest_host = newest.T_world_left.inverse() * host.T_world_left;
    std::vector<std::optional<DirectSighting>> seen(host.landmarks.size());
    oneapi::tbb::parallel_for(oneapi::tbb::blocked_range<std::size_t>(0, seen.size(), 32), [&](const auto& range) {
      for (std::size_t i = range.begin(); i != range.end(); ++i) {
        if (!host.landmarks[i].in_sight) continue;
        PatchPoint point = host.landmarks[i].point;
        point.pixel.z() = host.landmarks[i].disparity_px;
        seen[i] = find_directly(rig, host.view, point, newest.view, T_newest_host);
      }
    });
    for (std::size_t i = 0; i < seen.size(); ++i) {
      host.landmarks[i].in_sight = seen[i].has_value();
      if (!seen[i]) continue;
      host.landmarks[i].sightings.push_back({newest.id, *seen[i]});
      ++found;
    }
  }
  return found;
}

Bundle Window::make_bundle(const Vergence& vergence) const {
  Bundle bundle{.vergence = vergence, .vergence_rad = vergence.rad};
  const std::size_t first_id = members_.front().id;
  for (const Member& member : members_) {
    const int host = static_cast<int>(bundle.T_world_left.size());
    bundle.T_world_left.push_back(member.T_world_left);
    for (const Landmark& landmark : member.landmarks) {
      const int index = static_cast<int>(bundle.landmarks.size());
      bundle.landmarks.push_back({host, landmark.point.pixel, landmark.disparity_px});
      for (const Sighting& sighting : landmark.sightings) {
        bundle.observations.push_back(
            {index, static_cast<int>(sighting.member - first_id), sighting.seen.pixel, sighting.seen.covariance});
      }
    }
  }
  return bundle;
}

/// Takes over the adjusted poses and disparities, and drops the sightings that do not fit.
void Window::take_over(const Bundle& bundle, const BundleReport& report) {
  std::size_t view = 0, landmark_index = 0, observation = 0;
  for (Member& member : members_) {
    member.T_world_left = bundle.T_world_left[view++];
    for (Landmark& landmark : member.landmarks) {
      landmark.disparity_px = bundle.landmarks[landmark_index++].disparity_px;
      const auto misfit = [&](const Sighting&) { return !report.inlier[observation++]; };
      const std::size_t before = landmark.sightings.size();
      std::erase_if(landmark.sightings, misfit);
      if (landmark.sightings.size() < before) landmark.in_sight = false;
    }
  }
}

}  // namespace demslam
