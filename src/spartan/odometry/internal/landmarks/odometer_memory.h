// The state that the odometry keeps from one frame to the next, and its serialization.
#pragma once

#include "spartan/core/archive.h"
#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/core/time.h"
#include "spartan/odometry/internal/landmarks/landmark.h"
#include "spartan/odometry/internal/matching/sharpness.h"
#include "spartan/odometry/internal/motion_estimator.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan::internal {

/// A motion that was measured and how long it took.
struct MeasuredVelocity {
  Vector6d motion = Vector6d::Zero();  ///< Log of previous_from_current, (m, rad)
  double span_s = 0;                   ///< 0: none was measured yet
  bool is_known() const { return span_s > 0; }
};

/// The last frame before blurred or doubtful ones or before a gap, whose landmarks are searched again after them.
struct KeptFrame {
  LandmarkFrame frame;  ///< no landmarks: none is kept
  Stamp reference_stamp;
  UncertainPose kept_from_reference;
  std::int32_t age = 0;       ///< frames since
  std::int32_t searches = 0;  ///< good frames since in which it was not found

  bool is_kept() const { return !frame.map.landmarks.empty(); }
};

struct OdometerMemory {
  bool started = false;
  RectifiedStereo geometry;
  MeasuredVelocity latest_velocity;
  MeasuredVelocity steady_velocity;         ///< the latest one with enough landmarks for the status `tracking`
  std::int32_t ambiguous_frames = 0;        ///< latest frames with two motions of which neither was clearly the scene's
  DisparityOffset offset;                   ///< variance 0 before the first measured motion
  LandmarkFrame reference;                  ///< The latest frame that was measured: the next motion begins there.
  std::int32_t frames_since_reference = 0;  ///< that were lost or measured in the right image
  LandmarkFrame latest;                     ///< The latest frame where that is another one; no landmarks: unusable.
  Pose reference_from_latest;               ///< as predicted or measured
  Sharpness sharpness;                      ///< of the latest frame that was measured and not blurred
  KeptFrame kept;

  Bytes save() const;
  /// Codes: `configuration` where the bytes are of another version, `store_damaged` where they are damaged.
  static Result<OdometerMemory> restore(const Bytes& bytes);
};

}  // namespace spartan::internal
