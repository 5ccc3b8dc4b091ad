// Visual motions between frames.
#pragma once

#include "spartan/localization/internal/filter_memory.h"
#include "spartan/localization/internal/lever_arm.h"
#include "spartan/localization/internal/updates/motion_witnesses.h"
#include "spartan/localization/internal/updates/sensor_gates.h"
#include "spartan/localization/internal/updates/vision_drift.h"
#include "spartan/localization/internal/updates/wheel_update.h"
#include "spartan/localization/localization_options.h"

namespace spartan::internal {

class MotionUpdate {
 public:
  explicit MotionUpdate(const LocalizationOptions& options);

  /// The memory must be predicted to the end of the motion. What becomes of it is decided by decide(); the step of the
  /// wheels ends there, and the next motion begins there.
  void update(FilterMemory& memory, const RelativeMotion& of_body) const;

 private:
  bool update_by_motion(FilterMemory& memory, const VisualMotion& visual) const;
  bool accept(FilterMemory& memory, const MotionDecision& decision, const MotionEvidence& evidence) const;
  void count_agreement_of_imu(FilterMemory& memory, bool velocity_was_reset) const;
  void follow(FilterMemory& memory, const VisualMotion& visual, const Matrix6d& covariance) const;
  void reset_prediction(FilterMemory& memory, const Innovation& innovation, double nis,
                        const RelativeMotion& motion) const;

  LeverArm arm_;
  double white_noise_factor_;
  ConstantVelocityOptions constant_velocity_;
  SensorGates gates_;
  VisionDrift drift_;
  MotionWitnesses witnesses_;
  WheelUpdate wheels_;
};

}  // namespace spartan::internal
