// Where cameras and rover are while the images of a frame are exposed.
#pragma once

#include <optional>
#include <string>

#include "spartan/core/pose.h"
#include "spartan/rig/rig.h"
#include "spartan/sim/internal/camera/renderer.h"
#include "spartan/sim/internal/camera/rover_body.h"
#include "spartan/sim/internal/camera/truth.h"
#include "spartan/sim/internal/drive/body_motion.h"
#include "spartan/sim/internal/drive/camera_poses.h"
#include "spartan/sim/scenario.h"

namespace spartan::sim::internal {

/// The true rig on its drive, with delayed exposures, rolling shutters, and the rover where it is visible.
class FrameGeometry {
 public:
  FrameGeometry(const Rig& true_rig, const Scenario& scenario, BodyMotion motion);

  const BodyMotion& motion() const { return motion_; }
  Pose camera_pose(const PlannedFrame& frame, const std::string& camera, double time_s) const;
  /// The rover with its pan-tilt units as in the frame; none where it is not visible.
  std::optional<RoverBody> visible_rover(const PlannedFrame& frame) const;
  /// Poses for rendering an image that is exposed for `seconds`. Borrows the rover.
  Exposing exposing(const PlannedFrame& frame, const std::string& camera, double seconds,
                    const std::optional<RoverBody>& rover) const;
  /// Poses for the true disparities of a frame. Borrows the rover.
  PairPoses pair_poses(const PlannedFrame& frame, const StereoPair& pair, const std::optional<RoverBody>& rover) const;

 private:
  struct RowTimes {
    double first_s = 0, last_s = 0;  // the middle of the exposures of the first and the last row
  };
  RowTimes row_times(const PlannedFrame& frame, const std::string& camera) const;

  Rig rig_;
  SensorOptions sensor_;
  ChassisOptions chassis_;
  BodyMotion motion_;
  CameraPoses camera_poses_;
};

}  // namespace spartan::sim::internal
