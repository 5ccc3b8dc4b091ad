// Everything the localization takes in, as one value with a place in time.
#pragma once

#include <variant>

#include "spartan/camera/samples.h"
#include "spartan/core/pose_constraint.h"
#include "spartan/localization/relative_motion.h"
#include "spartan/localization/sensor_health.h"

namespace spartan {

/// A constraint on the pose at the last shot that came when the buffer had left that shot behind (the rover stood for
/// long, and its map is made when it goes on): taken at a later moment, by the clone of that pose.
struct LateConstraint {
  Stamp stamp;  ///< when it is taken
  PoseConstraint at_shot;
};

/// Of several with one stamp the earlier kind comes first: the IMU reaches the moment, vision stands on it, the rest is
/// judged against both.
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

/// Whether `a` is taken before `b`.
inline bool comes_before(const Measurement& a, const Measurement& b) {
  const Stamp at = stamp_of_measurement(a), bt = stamp_of_measurement(b);
  return at != bt ? at < bt : a.index() < b.index();
}

LocalizationSensor sensor_of(const Measurement& m);

/// Whether all numbers are finite (and a covariance or information can be one).
bool is_sound(const Measurement& m);

}  // namespace spartan
