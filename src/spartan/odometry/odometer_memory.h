// All that the odometry carries from one shot to the next, and its form as bytes.
#pragma once

#include "spartan/core/archive.h"
#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/core/time.h"
#include "spartan/odometry/landmark.h"
#include "spartan/odometry/motion_estimation.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan {

struct OdometerMemory {
  bool started = false;
  Stamp stamp;  ///< of the latest shot
  RectifiedStereo geometry;
  Vector6d last_motion = Vector6d::Zero();  ///< Log of the latest measured previous_from_current
  double velocity_span_s = 0;               ///< time that motion took; 0: none yet
  DisparityOffset offset;                   ///< variance 0 before the first motion
  LandmarkMemory map;

  Bytes save() const;
  /// Code `store_damaged` where the bytes are of another version or damaged.
  static Result<OdometerMemory> restore(const Bytes& bytes);
};

}  // namespace spartan
