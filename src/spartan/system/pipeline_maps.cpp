// Local maps of stops and keyframes, and their constraints on the pose.
#include <algorithm>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "spartan/system/internal/pipeline_state.h"

namespace spartan {

using namespace internal;

namespace {

// One entry for each stage, in the order of their first.
std::vector<StageTime> sums_by_stage(const std::vector<StageTime>& times) {
  std::vector<StageTime> sums;
  for (const StageTime& time : times) {
    auto sum = std::find_if(sums.begin(), sums.end(), [&](const StageTime& s) { return s.stage == time.stage; });
    if (sum == sums.end()) sum = sums.insert(sums.end(), {time.stage, 0, 0});
    sum->wall_ms += time.wall_ms;
    sum->cpu_ms += time.cpu_ms;
  }
  return sums;
}

}  // namespace

Status Pipeline::State::add_odometry_frame(const StereoFrame& frame, const RectifiedPair& rectified,
                                           const RelativeMotion& motion) {
  if (!maps_stops) return {};
  // A stop begins with a pair.
  const bool begins = frame.position_id != stop_stage.position_id();
  if (begins && !has_both_images(rectified)) return {};
  return stop_stage.add_odometry_frame(frame.position_id, rectified, pair.nearest_m,
                                       localized_at(rectified.stamp).world_from_body, motion);
}

// Adds a frame of another pair to the stop that it belongs to.
Status Pipeline::State::add_view(const StereoFrame& frame) {
  if (!maps_stops || frame.position_id < 0) return {};
  const StereoPair& of = *rig.find_pair(frame.pair);
  const auto images = FrozenCameras::fingerprints_of(frame);
  if (Status status = check_new(frame, index_of(of), images); !status) return status;
  const auto rectified = clock.measure("imaging", [&] { return imager.process(frame); });
  if (!rectified) return failure(rectified);
  clock.add(rectified->times);
  Status added = clock.measure(
      "reconstruction", [&] { return stop_stage.add_view(frame.position_id, frame.pair, *rectified, of.nearest_m); });
  if (added) frozen_cameras.remember(index_of(of), images);
  return added;
}

Result<std::optional<MappedStop>> Pipeline::State::finish_stop() {
  if (stop_stage.mapper().views().empty()) {
    stop_stage.clear();
    return std::nullopt;
  }
  const auto survey = clock.measure("mapping", [&] { return stop_stage.survey(); });
  auto merged =
      clock.measure("slam", [&] { return merger.add(survey->points, survey->stamp, survey->world_from_body); });
  if (!merged) return failure(merged);  // the stop stays the current one
  stop_stage.clear();
  return apply(*survey, std::move(*merged));
}

// The global map does not change while a keyframe is pending, so the part of it that the map will be matched to is
// taken now, by the thread that may read the store.
Status Pipeline::State::start_keyframe_map() {
  if (!keyframe_stage.is_pending() || !keyframe_task.empty()) return {};
  keyframe_map.clock.take();
  auto global = keyframe_map.clock.measure("slam", [&] { return merger.excerpt_around(keyframe_stage.prior().pose); });
  if (!global) return failure(global);
  keyframe_task =
      workers.start([this, excerpt = std::make_shared<const std::optional<MapExcerpt>>(std::move(*global))] {
        make_keyframe_map(*excerpt);
      });
  return {};
}

void Pipeline::State::make_keyframe_map(const std::optional<MapExcerpt>& global) {
  StageClock& times = keyframe_map.clock;
  const auto points = times.measure("mapping", [&] { return keyframe_stage.points(pair.nearest_m); });
  if (!points) {
    keyframe_map.matched = failure(points);
    return;
  }
  keyframe_map.matched = times.measure("slam", [&] {
    return merger.match(*points, keyframe_stage.stamp(), keyframe_stage.prior(), global, ThreadPool(1));
  });
}

Result<MappedStop> Pipeline::State::finish_keyframe() {
  if (Status status = start_keyframe_map(); !status) return failure(status);
  keyframe_task.wait();
  if (!keyframe_map.matched) return failure(keyframe_map.matched);
  Status fused = keyframe_map.clock.measure("slam", [&] { return merger.fuse(*keyframe_map.matched); });
  if (!fused) return failure(fused);  // the keyframe stays pending
  clock.add(sums_by_stage(keyframe_map.clock.take()));
  const StopSurvey survey = keyframe_stage.survey();
  keyframe_task = {};
  keyframe_stage.clear();
  return apply(survey, std::move(*keyframe_map.matched));
}

MappedStop Pipeline::State::apply(const StopSurvey& survey, MapMergeResult merged) {
  if (merged.constraint) apply_map_constraint(survey, *merged.constraint);
  return {survey.position_id, survey.stamp, survey.views, survey.world_from_body, std::move(merged)};
}

// A frame whose motion is unknown or of which an image is missing is no keyframe.
void Pipeline::State::update_keyframes(const RectifiedPair& rectified, const MotionEstimate& motion,
                                       const RelativeMotion& body_motion) {
  if (!maps_keyframes) return;
  if (!motion.first) keyframe_stage.advance(body_motion);
  const bool usable = motion.status != TrackingStatus::lost && has_both_images(rectified);
  if (!usable || !keyframe_stage.is_due(rectified, world_from_left)) return;
  if (keyframe_stage.is_pending()) {
    keyframe_stage.hurry();
  } else {
    keyframe_stage.begin(rectified, world_from_left, localized_at(rectified.stamp).world_from_body, body_motion);
  }
}

// The constraint is on the pose at the first frame of the stop. During a long stop that frame leaves the buffer of a
// filter; the constraint is then transported to the last frame, whose pose the filter still has.
void Pipeline::State::apply_map_constraint(const StopSurvey& survey, const PoseConstraint& constraint) {
  const PoseConstraint last = transported(constraint, survey.first_from_last, survey.last_stamp);
  localizer.add(localizer.reaches(constraint.stamp) ? constraint : last);
  slam_filter.add(slam_filter.reaches(constraint.stamp) ? constraint : last);
}

}  // namespace spartan
