// Local maps of stops and keyframes, and their constraints on the pose.
#include <fmt/format.h>

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
                                       localized_at(rectified.stamp).world_from_body, motion, back_end);
}

// Adds a frame of another pair to the stop that it belongs to.
Status Pipeline::State::add_view(const StereoFrame& frame) {
  if (!maps_stops || frame.position_id < 0) return {};
  const StereoPair& of = *rig.find_pair(frame.pair);
  view_was_dropped = pace == Pace::live && (back_end.backlog() >= kMostViews || stop_stage.departed() >= kMostStops);
  if (view_was_dropped) {
    return failure(ErrorCode::frame_rejected, "dropped: the back end has not computed the views before",
                   fmt::format("frame {} of pair '{}'", frame.frame_id, frame.pair));
  }
  const auto images = FrozenCameras::fingerprints_of(frame);
  if (Status status = check_new(frame, index_of(of), images); !status) return status;
  const auto rectified = clock.measure("imaging", [&] { return imager.process(frame); });
  if (!rectified) return failure(rectified);
  clock.add(rectified->times);
  Status added = stop_stage.add_view(frame.position_id, frame.pair, *rectified, of.nearest_m, back_end);
  if (added) frozen_cameras.remember(index_of(of), images);
  return added;
}

// The global map does not change while a match is made, so the part of it that the map will be matched to is taken
// before, by the thread that may read the store. A keyframe without a delay is mapped where it is applied, but live no
// frame waits for it.
Status Pipeline::State::start_maps() {
  if (Status status = start_stop_match(); !status) return status;
  return keyframe_stage.is_ready() && pace == Pace::recorded ? Status() : start_keyframe_map();
}

Status Pipeline::State::start_stop_match() {
  if (!stop_stage.is_unmatched()) return {};
  StageClock times(CLOCK_THREAD_CPUTIME_ID);
  auto global = times.measure("slam", [&] { return merger.excerpt_around(stop_stage.prior()); });
  if (!global) return failure(global);
  stop_stage.start_match(merger, std::move(*global), std::move(times), back_end);
  return {};
}

// A stop that the rover leaves cannot be matched before the map of the stop before it is applied.
Result<std::optional<MappedStop>> Pipeline::State::apply_due_map(bool leaves_stop) {
  std::optional<MappedStop> applied;
  if (leaves_stop && options.stop_delay_frames == 0 && pace == Pace::recorded) return map_at_departure();
  if (stop_stage.is_due(leaves_stop && stop_stage.has_views() && pace == Pace::recorded) &&
      is_made(stop_stage.ticket())) {
    auto stop = finish_departed_stop();
    if (!stop) return failure(stop);
    applied = std::move(*stop);
  } else if (keyframe_stage.is_ready() && (pace == Pace::recorded || is_made(keyframe_map->ticket))) {
    auto map = finish_keyframe();
    if (!map) return failure(map);
    applied = std::move(*map);
  }
  return applied;
}

// Without a delay.
Result<std::optional<MappedStop>> Pipeline::State::map_at_departure() {
  if (!stop_stage.has_views()) return std::nullopt;
  StageClock times(CLOCK_THREAD_CPUTIME_ID);
  auto global = times.measure("slam", [&] { return merger.excerpt_around(stop_stage.prior()); });
  if (!global) return failure(global);
  stop_stage.depart(back_end);
  stop_stage.start_match(merger, std::move(*global), std::move(times), back_end);
  auto stop = finish_departed_stop();
  if (stop) return std::move(*stop);
  stop_stage.undo_departure();
  return failure(stop);
}

Result<MappedStop> Pipeline::State::finish_departed_stop() {
  back_end.wait(stop_stage.ticket());
  StageClock times(CLOCK_THREAD_CPUTIME_ID);
  Status fused = times.measure("slam", [&] { return merger.fuse(stop_stage.matched()); });
  if (!fused) return failure(fused);  // the stop stays the oldest one
  const StopSurvey survey = stop_stage.survey();
  StopStage::Mapped mapped = stop_stage.take_oldest();
  for (const StageTime& time : times.take()) mapped.times.push_back(time);
  // Each view is timed; the steps of the match are one stage.
  const auto match = std::stable_partition(mapped.times.begin(), mapped.times.end(),
                                           [](const StageTime& t) { return t.stage != "slam"; });
  clock.add({mapped.times.begin(), match});
  clock.add(sums_by_stage({match, mapped.times.end()}));
  MappedStop stop = apply(survey, std::move(mapped.matched));
  stop.seconds = mapped.seconds;
  return stop;
}

Result<std::optional<MappedStop>> Pipeline::State::finish_stop() {
  stop_stage.depart(back_end);
  if (!stop_stage.has_departed()) return std::nullopt;
  if (Status status = start_stop_match(); !status) return failure(status);
  auto stop = finish_departed_stop();
  if (!stop) return failure(stop);
  return std::move(*stop);
}

Status Pipeline::State::start_keyframe_map() {
  if (!keyframe_stage.is_pending() || keyframe_map) return {};
  auto map = std::make_shared<KeyframeMap>();
  auto global = map->clock.measure("slam", [&] { return merger.excerpt_around(keyframe_stage.prior().pose); });
  if (!global) return failure(global);
  keyframe_map = map;
  map->ticket = back_end.submit(
      "map of a keyframe",
      [this, map, excerpt = std::make_shared<const std::optional<MapExcerpt>>(std::move(*global))] {
        const auto points = map->clock.measure("mapping", [&] { return keyframe_stage.points(pair.nearest_m); });
        if (!points) {
          map->matched = failure(points);
          return;
        }
        map->matched = map->clock.measure("slam", [&] {
          return merger.match(*points, keyframe_stage.stamp(), keyframe_stage.prior(), *excerpt, back_end.one_thread());
        });
      });
  return {};
}

Result<MappedStop> Pipeline::State::finish_keyframe() {
  if (Status status = start_keyframe_map(); !status) return failure(status);
  back_end.wait(keyframe_map->ticket);
  if (!keyframe_map->matched) return failure(keyframe_map->matched);
  Status fused = keyframe_map->clock.measure("slam", [&] { return merger.fuse(*keyframe_map->matched); });
  if (!fused) return failure(fused);  // the keyframe stays pending
  const std::shared_ptr<KeyframeMap> map = std::exchange(keyframe_map, nullptr);
  clock.add(sums_by_stage(map->clock.take()));
  const StopSurvey survey = keyframe_stage.survey();
  keyframe_stage.clear();
  return apply(survey, std::move(*map->matched));
}

MappedStop Pipeline::State::apply(const StopSurvey& survey, MapMergeResult merged) {
  if (merged.constraint) apply_map_constraint(survey, *merged.constraint);
  return {survey.position_id, survey.stamp, survey.views, survey.world_from_body, std::move(merged), 0};
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
