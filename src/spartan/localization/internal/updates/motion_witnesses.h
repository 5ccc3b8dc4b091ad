// What the other sensors say about a visual motion.
#pragma once

#include <optional>

#include "spartan/localization/internal/filter_memory.h"
#include "spartan/localization/internal/kalman_update.h"
#include "spartan/localization/internal/updates/motion_decision.h"
#include "spartan/localization/internal/updates/visual_motion.h"
#include "spartan/localization/localization_options.h"

namespace spartan::internal {

/// The last reading before a time, if it is fresh.
std::optional<InclinometerSample> tilt_at(const InclinometerMemory& tilt, Stamp stamp);

class MotionWitnesses {
 public:
  explicit MotionWitnesses(const LocalizationOptions& options);

  /// The memory must be predicted to the end of the motion, which began at its vision clone; `innovation` is that of
  /// the motion against this prediction.
  MotionEvidence evidence_of(const FilterMemory& memory, const VisualMotion& visual,
                             const Innovation& innovation) const;

  /// The witnesses one by one; none where they cannot tell. NIS of the motion against the count of the wheels since the
  /// last frame:
  std::optional<double> compare_with_wheels(const FilterMemory& memory, const VisualMotion& visual) const;
  /// NIS of the direction of up at the end of the motion against the readings at both ends; their bias cancels. A rover
  /// that rocks differs more from the readings, which come before the frames: their noise is measured.
  std::optional<double> compare_with_inclinometer(const FilterMemory& memory, const VisualMotion& visual) const;
  /// Distance along the body's x since the last frame, by the wheels, by the IMU and by vision. A repeating texture
  /// shifts a visual motion by its period, with a small covariance.
  std::optional<ForwardComparison> compare_forward(const FilterMemory& memory, const VisualMotion& visual) const;

 private:
  std::optional<WheelStep> wheel_step_since_frame(const FilterMemory& memory, Stamp stamp) const;

  double white_noise_factor_;
  WheelOdometryOptions wheels_;
  TiltOptions inclinometer_;
  Eigen::Vector3d wheel_centre_;  ///< relative to the IMU
};

/// The noise of the inclinometer, by what it said about a motion.
void learn_inclinometer(InclinometerMemory& inclinometer, const MotionEvidence& evidence);

}  // namespace spartan::internal
