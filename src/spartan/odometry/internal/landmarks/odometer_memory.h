// The state that the odometry keeps from one frame to the next, and its serialization.
#pragma once

#include "spartan/core/archive.h"
#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/core/time.h"
#include "spartan/odometry/internal/landmarks/landmark.h"
#include "spartan/odometry/internal/motion_estimator.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan::internal {

struct OdometerMemory {
  bool started = false;
  RectifiedStereo geometry;
  Vector6d last_motion = Vector6d::Zero();  ///< Log of the latest measured previous_from_current, (m, rad)
  double velocity_span_s = 0;               ///< duration of that motion; 0: none measured yet
  std::int32_t ambiguous_frames = 0;        ///< latest frames with two motions of which neither was clearly the scene's
  DisparityOffset offset;                   ///< variance 0 before the first measured motion
  LandmarkFrame reference;                  ///< The latest frame that was measured: the next motion begins there.
  std::int32_t frames_since_reference = 0;  ///< that were lost or measured in the right image
  LandmarkFrame latest;                     ///< The latest frame where that is another one; no landmarks: unusable.
  Pose reference_from_latest;               ///< as predicted or measured

  Bytes save() const;
  /// Codes: `configuration` where the bytes are of another version, `store_damaged` where they are damaged.
  static Result<OdometerMemory> restore(const Bytes& bytes);
};

}  // namespace spartan::internal
