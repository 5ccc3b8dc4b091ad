// The measurements of the localization as one variant with a stamp.
#pragma once

#include <variant>

#include "spartan/camera/samples.h"
#include "spartan/core/pose_constraint.h"
#include "spartan/localization/relative_motion.h"
#include "spartan/localization/sensor_health.h"

namespace spartan {

/// A map constraint on the pose at the last frame that arrived when that frame was older than the buffer (the map of a
/// stop is made when the rover drives on): applied at a later time to the clone of that pose.
struct LateConstraint {
  Stamp stamp;  ///< when it is applied
  PoseConstraint at_frame;
};

/// Measurements with equal stamps are ordered by their index here: the IMU propagates to that time, vision corrects the
/// prediction, the others are gated against both.
using Measurement = std::variant<ImuSample, RelativeMotion, WheelSample, CompassSample, InclinometerSample,
                                 PoseConstraint, LateConstraint>;

inline Stamp stamp_of_measurement(const Measurement& m) {
  return std::visit(
      [](const auto& value) {
        if constexpr (requires { value.stamp; }) {
          return value.stamp;
        } else {
          return value.to;
        }
      },
      m);
}

/// Whether `a` is processed before `b`.
inline bool comes_before(const Measurement& a, const Measurement& b) {
  const Stamp at = stamp_of_measurement(a), bt = stamp_of_measurement(b);
  return at != bt ? at < bt : a.index() < b.index();
}

LocalizationSensor sensor_of(const Measurement& m);

/// Whether all numbers are finite and no variance or information is negative.
bool is_valid(const Measurement& m);

}  // namespace spartan
