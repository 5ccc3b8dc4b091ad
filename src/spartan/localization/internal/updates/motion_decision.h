// Who is right where a visual motion and the other sensors contradict each other.
#pragma once

#include <array>
#include <optional>

#include "spartan/localization/localizer.h"

namespace spartan::internal {

/// Whether IMU, wheels and vision agree on the distance since the last frame.
struct ForwardComparison {
  bool imu_and_wheels_agree = false;
  bool vision_contradicts_imu = false;
  double vision_nis = 0;  ///< normalized innovation squared of vision against the mean of the IMU and the wheels
};

/// What is known about a visual motion before it is used.
struct MotionEvidence {
  SensorState vision = SensorState::ok, imu = SensorState::ok, wheels = SensorState::ok;
  SensorState inclinometer = SensorState::ok;
  bool predicted_by_imu = false;         ///< over the whole motion
  double nis = 0;                        ///< against the prediction by the IMU, 6 degrees of freedom; 0 without it
  std::optional<double> against_wheels;  ///< NIS against their count since the last frame, 4 degrees of freedom
  /// NIS of the translation against a prediction without the IMU that contains the wheels, 3 degrees of freedom.
  std::optional<double> against_prediction_by_wheels;
  /// NIS of the rotation against two readings, 2 degrees of freedom; without a prediction by the IMU.
  std::optional<double> against_inclinometer;
  std::optional<ForwardComparison> forward;  ///< where IMU and wheels can tell the distance
  bool follows_doubted = false;  ///< the motion before was rejected as wild, and ended where this one begins
  bool keeps_reference = false;  ///< the next motion begins where this one does, and contains it
  bool is_implausible = false;   ///< far off what the motions before it predict
};

enum class MotionUse : std::uint8_t {
  correct,  ///< correct the prediction
  reset,    ///< correct the prediction without giving it weight: vision contradicts the IMU, which is wrong
  follow,   ///< replace the pose: there is no prediction by an IMU
  reject,   ///< coast on the prediction
  doubt,    ///< the same, until the next motion tells whether this one was right
};

struct MotionDecision {
  MotionUse use = MotionUse::follow;
  bool accept_doubted = false;  ///< the motion before, rejected as wild, was right
  bool uncertain = false;       ///< to be used with its own size as standard deviation
  /// What the monitor of vision has to count: a test with this result, and the reason if it failed.
  double nis = 0, gate = 0;
  HealthReason why = HealthReason::none;
};

/// Thresholds of normalized innovations squared.
struct MotionGates {
  double vision = 0;                ///< of vision against the IMU, 6 degrees of freedom
  std::array<double, 7> by_rows{};  ///< of the other sensors, by degrees of freedom
};

/// Decides by a table, from the first line that applies:
///
/// | evidence | use |
/// |---|---|
/// | IMU and wheels agree on the distance, vision is 5 σ off both | reject (outvoted) |
/// | a witness that is ok contradicts it by 12 σ (wild), and the motion before was not doubted | doubt |
/// | no prediction by an IMU, implausible, and the wheels do not confirm it | follow, uncertain |
/// | no prediction by an IMU | follow |
/// | inside the gate of the prediction by the IMU | correct |
/// | outside, vision is excluded, and the wheels do not contradict the IMU | reject (disagrees) |
/// | outside | reset |
///
/// Witnesses of a wild motion: the count of the wheels; the prediction by the IMU, unless the wheels agree with the
/// motion; without an IMU, the distance predicted with the wheels, if their count alone cannot tell, and the change of
/// the inclinometer's readings. (A compass is no witness: its outliers are larger than the error of a motion.) A motion
/// that follows a doubted one and is contradicted, too, proves that the doubted one was right. Vision that is excluded
/// is never doubted, nor is a motion that the next one contains.
MotionDecision decide(const MotionEvidence& evidence, const MotionGates& gates);

/// What a contradiction of vision means for an IMU that was suspect: how its monitor goes on after a motion inside the
/// gate. Agreement ends the series of contradictions, but not where the velocity was reset by the motion before (then
/// anything agrees) and the contradiction was gross.
bool ends_contradictions(const SensorMonitor& imu, bool velocity_was_reset, const MotionGates& gates);

}  // namespace spartan::internal
