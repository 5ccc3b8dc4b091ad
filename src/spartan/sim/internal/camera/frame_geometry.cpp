#include "spartan/sim/internal/camera/frame_geometry.h"

#include <cstddef>
#include <utility>
#include <vector>

namespace spartan::sim::internal {
namespace {

template <class PoseAt>
ShutterPoses shutter_poses(double first_s, double last_s, double seconds, const PoseAt& pose_at) {
  ShutterPoses poses;
  poses.rolls = first_s != last_s;
  for (std::size_t t = 0; t < kTimes; ++t) {
    const double offset_s = ((static_cast<double>(t) + 0.5) / kTimes - 0.5) * seconds;
    poses.top[t] = pose_at(first_s + offset_s);
    if (poses.rolls) poses.bottom[t] = pose_at(last_s + offset_s);
  }
  return poses;
}

template <class PoseAt>
ShutterPose shutter_pose(double first_s, double last_s, const PoseAt& pose_at) {
  return {pose_at(first_s), pose_at(last_s), first_s != last_s};
}

}  // namespace

FrameGeometry::FrameGeometry(const Rig& true_rig, const Scenario& scenario, BodyMotion motion)
    : rig_(true_rig),
      sensor_(scenario.sensor),
      chassis_(scenario.chassis),
      motion_(std::move(motion)),
      camera_poses_(true_rig, scenario.rover_errors, scenario.seed, motion_.seconds()) {}

Pose FrameGeometry::camera_pose(const PlannedFrame& frame, const std::string& camera, double time_s) const {
  return motion_.world_from_body(time_s) * camera_poses_.body_from_camera(camera, frame, time_s);
}

FrameGeometry::RowTimes FrameGeometry::row_times(const PlannedFrame& frame, const std::string& camera) const {
  const double right_ms = camera == rig_.find_pair(frame.pair)->right ? sensor_.right_delay_ms : 0;
  const double middle_s = frame.time_s + 1e-3 * (sensor_.delay_ms + right_ms);
  const double half_s = 0.5e-3 * sensor_.rolling_shutter_ms;
  return {middle_s - half_s, middle_s + half_s};
}

std::optional<RoverBody> FrameGeometry::visible_rover(const PlannedFrame& frame) const {
  if (!chassis_.visible) return std::nullopt;
  std::vector<MountedCamera> cameras;
  cameras.reserve(rig_.cameras.size());
  for (const Camera& camera : rig_.cameras)
    cameras.push_back({camera_poses_.body_from_camera(camera.name, frame, frame.time_s), camera.mount != "body"});
  return RoverBody(make_rover_mesh(chassis_, rig_.pan_tilt_units, cameras));
}

Exposing FrameGeometry::exposing(const PlannedFrame& frame, const std::string& camera, double seconds,
                                 const std::optional<RoverBody>& rover) const {
  const auto [first_s, last_s] = row_times(frame, camera);
  Exposing result;
  result.world_from_camera =
      shutter_poses(first_s, last_s, seconds, [&](double time_s) { return camera_pose(frame, camera, time_s); });
  if (!rover) return result;
  result.rover = &*rover;
  result.world_from_body =
      shutter_poses(first_s, last_s, seconds, [&](double time_s) { return motion_.world_from_body(time_s); });
  return result;
}

PairPoses FrameGeometry::pair_poses(const PlannedFrame& frame, const StereoPair& pair,
                                    const std::optional<RoverBody>& rover) const {
  const auto pose_of = [&](const std::string& camera) {
    const auto [first_s, last_s] = row_times(frame, camera);
    return shutter_pose(first_s, last_s, [&](double time_s) { return camera_pose(frame, camera, time_s); });
  };
  PairPoses poses;
  poses.world_from_left = pose_of(pair.left);
  poses.world_from_right = pose_of(pair.right);
  if (!rover) return poses;
  const auto [first_s, last_s] = row_times(frame, pair.left);
  poses.rover = &*rover;
  poses.world_from_body = shutter_pose(first_s, last_s, [&](double time_s) { return motion_.world_from_body(time_s); });
  return poses;
}

}  // namespace spartan::sim::internal
