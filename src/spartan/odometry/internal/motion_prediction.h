// What is known of a motion before it is measured.
#pragma once

#include <vector>

#include "spartan/core/pose.h"
#include "spartan/core/time.h"
#include "spartan/odometry/internal/landmarks/odometer_memory.h"
#include "spartan/odometry/internal/motion_estimator.h"

namespace spartan::internal {

struct MotionPrediction {
  Pose motion;                        ///< previous_from_current
  std::vector<Pose> other_starts;     ///< are tried where landmarks are not found by `motion`
  bool from_measured_motion = false;  ///< only then a second motion that fits the prediction better is looked for
  bool over_gap = false;              ///< no images were taken for long, so it is rather a guess
  DisparityOffset offset;

  /// The same prediction for the motion from another frame.
  MotionPrediction from(const Pose& other_from_previous) const;
};

/// From the reference to a frame at `now`: the latest measured motion, scaled to the time since the latest frame, but
/// at most twice: a rover that took no images for long has rather stopped than driven on.
MotionPrediction predict_motion(const OdometerMemory& memory, const MotionEstimationOptions& options, Stamp now);

/// Of a predicted motion that was not measured: the rover may as well not have moved.
Matrix6d covariance_of_prediction(const Pose& motion);

}  // namespace spartan::internal
