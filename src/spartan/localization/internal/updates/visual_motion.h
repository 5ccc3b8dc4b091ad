// A visual motion as the filter uses it.
#pragma once

#include "spartan/localization/internal/lever_arm.h"
#include "spartan/localization/internal/measurement_models.h"
#include "spartan/localization/localizer.h"

namespace spartan::internal {

/// A visual motion of the IMU, and how the errors that last act on it.
struct VisualMotion {
  RelativeMotion motion;
  MotionErrors errors;

  static VisualMotion of_imu(const RelativeMotion& of_body, const LeverArm& arm);
};

inline VisualMotion VisualMotion::of_imu(const RelativeMotion& of_body, const LeverArm& arm) {
  const Matrix6d& to_imu = arm.to_imu();
  VisualMotion m;
  m.motion = of_body;
  m.motion.previous_from_current = arm.imu_motion(of_body.previous_from_current);
  m.motion.covariance = to_imu * of_body.covariance * to_imu.transpose();
  m.motion.by_calibration = to_imu * of_body.by_calibration;
  m.motion.lasting_sigma.reset();  // the body's; D of the IMU is not diagonal
  if (!of_body.is_stationary()) m.errors = {to_imu * of_body.drift_scale().asDiagonal(), m.motion.by_calibration};
  return m;
}

}  // namespace spartan::internal
