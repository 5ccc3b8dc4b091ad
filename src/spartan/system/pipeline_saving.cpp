// Saving and restoring the state of a Pipeline.
#include <fmt/format.h>

#include <array>
#include <string>
#include <vector>

#include "spartan/core/archive.h"
#include "spartan/system/internal/pipeline_state.h"

namespace spartan {

namespace {

constexpr std::uint32_t kPipelineVersion = 14;  // of save(); raise it when the saved state changes

}  // namespace

Bytes Pipeline::save() const {
  const State& s = *state_;
  ArchiveWriter out;
  out.put(kPipelineVersion);
  out.put(s.started);
  out.put(s.last_stamp.ns);
  out.put(s.up_in_body.has_value());
  out.put(s.up_in_body.value_or(Eigen::Vector3d::UnitZ()));
  out.put(s.world_from_left);
  out.put(s.left_from_body);
  out.put(s.reference.stamp.ns);
  out.put(s.reference.world_from_left);
  out.put(s.reference.left_from_body);
  out.put(s.reference.odom_from_body);
  out.put_array(s.velocity.data(), 6);
  out.put(s.distance_m);
  s.frozen_cameras.save(out);
  s.terrain_stage.save(out);
  s.stop_stage.save(out);
  s.keyframe_stage.save(out);
  const bool odometry_only = s.options.odometry_only;
  for (const Bytes& stage :
       {s.odometer.save(), s.localizer.save(), odometry_only ? s.dead_reckoning.save() : s.odometry_filter.save(),
        odometry_only ? Bytes() : s.slam_filter.save(), s.merger.save()})
    out.put_array(stage.data(), stage.size());
  return out.take();
}

Status Pipeline::restore(const Bytes& state, TileStore& maps) {
  ArchiveReader in(state);
  const std::string what = "run.sqlite: saved state of the pipeline";
  if (Status status = in.expect_version(kPipelineVersion, what); !status) return status;
  State& s = *state_;
  s.keyframe_map = nullptr;
  s.started = in.get<bool>();
  s.last_stamp = in.get_stamp();
  const bool has_up = in.get<bool>();
  s.up_in_body = in.get_vector3();
  if (!has_up) s.up_in_body.reset();
  s.world_from_left = in.get_pose();
  s.left_from_body = in.get_pose();
  s.reference.stamp = in.get_stamp();
  s.reference.world_from_left = in.get_pose();
  s.reference.left_from_body = in.get_pose();
  s.reference.odom_from_body = in.get_pose();
  const std::vector<double> velocity = in.get_array<double>();
  if (velocity.size() == 6) s.velocity = Eigen::Map<const Vector6d>(velocity.data());
  s.distance_m = in.get_finite();
  s.frozen_cameras.restore(in);
  s.terrain_stage.restore(in);
  s.stop_stage.restore(in);
  s.keyframe_stage.restore(in);
  std::array<Bytes, 5> stages;
  for (Bytes& stage : stages) stage = in.get_array<std::uint8_t>();
  if (Status status = in.finish(what); !status) return status;
  if (velocity.size() != 6 || !s.velocity.allFinite()) {
    return failure(ErrorCode::store_damaged, "is damaged: the velocity is not possible", what,
                   "run again into a new folder");
  }
  if (Status status = s.odometer.restore(stages[0]); !status) return status;
  if (Status status = s.localizer.restore(stages[1]); !status) return status;
  if (s.options.odometry_only) {
    if (Status status = s.dead_reckoning.restore(stages[2]); !status) return status;
  } else {
    if (Status status = s.odometry_filter.restore(stages[2]); !status) return status;
    if (Status status = s.slam_filter.restore(stages[3]); !status) return status;
  }
  const bool same_start =
      s.localizer.started() == s.started &&
      (s.options.odometry_only || (s.odometry_filter.started() == s.started && s.slam_filter.started() == s.started));
  if (!same_start) {
    return failure(ErrorCode::store_damaged, "is damaged: not all stages have started", what,
                   "run again into a new folder");
  }
  return s.merger.restore(stages[4], maps);
}

std::vector<FrameKey> Pipeline::pending_frames() const {
  const State& s = *state_;
  std::vector<FrameKey> pending;
  for (const auto& stamp : {s.terrain_stage.pending_frame(), s.keyframe_stage.pending_frame()}) {
    if (stamp) pending.push_back({s.pair.name, *stamp});
  }
  const std::vector<FrameKey> of_stops = s.stop_stage.pending_frames(s.pair.name);
  pending.insert(pending.end(), of_stops.begin(), of_stops.end());
  return pending;
}

void Pipeline::abandon_pending_frames() {
  State& s = *state_;
  if (s.terrain_stage.pending_frame()) s.terrain_stage.abandon_frame();
  if (s.keyframe_stage.pending_frame()) s.keyframe_stage.clear();
  s.stop_stage.abandon_pending_frames();
}

Status Pipeline::restore_frame(const StereoFrame& frame) {
  State& s = *state_;
  const StereoPair* const pair = s.rig.find_pair(frame.pair);
  if (pair == nullptr) {
    return failure(ErrorCode::frame_rejected, fmt::format("the rig has no pair named '{}'", frame.pair),
                   fmt::format("frame {}", frame.frame_id));
  }
  const auto rectified = s.imager.process(frame);
  if (!rectified) return failure(rectified);
  if (pair->name != s.pair.name)
    return s.stop_stage.restore_view(pair->name, *rectified, pair->nearest_m, frame.position_id, s.back_end);
  // A frame may be pending for several reasons, and is then listed and passed in several times.
  if (s.terrain_stage.pending_frame() == rectified->stamp) {
    s.terrain_stage.restore_frame(*rectified, s.pair.nearest_m, s.disparity_computer, s.back_end);
    // The next frame of a dense odometry uses the same computer.
    if (s.odometry_is_dense()) s.back_end.wait(s.terrain_stage.ticket());
  } else if (s.keyframe_stage.pending_frame() == rectified->stamp) {
    s.keyframe_stage.restore_frame(*rectified);
  } else {
    s.stop_stage.restore_first_frame(*rectified, s.pair.nearest_m);
  }
  return {};
}

}  // namespace spartan
