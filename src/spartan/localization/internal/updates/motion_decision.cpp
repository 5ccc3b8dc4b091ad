#include "spartan/localization/internal/updates/motion_decision.h"

#include <algorithm>

namespace spartan::internal {
namespace {

/// Vision is outvoted by IMU and wheels where it differs from their mean by more than 5 standard deviations.
constexpr double kOutvoted = 5 * 5;
/// A visual motion is wild where the IMU or the wheels contradict it by this factor times the gate: 12 standard
/// deviations.
constexpr double kWildFactor = 4;
/// A contradiction is gross beyond this factor times the gate: 60 standard deviations.
constexpr double kGrossFactor = 100;

/// Wheels that were excluded, because the IMU contradicts them, still confirm a motion, but do not contradict it.
bool wheels_confirm(const MotionEvidence& e, const MotionGates& gates) {
  return e.against_wheels && *e.against_wheels <= gates.by_rows[4];
}

bool is_wild(const MotionEvidence& e, const MotionGates& gates) {
  const bool wheels_ok = e.wheels == SensorState::ok;
  if (wheels_ok && e.against_wheels && *e.against_wheels > kWildFactor * gates.by_rows[4]) return true;
  if (e.predicted_by_imu)
    return e.imu == SensorState::ok && e.nis > kWildFactor * gates.vision && !wheels_confirm(e, gates);
  if (e.inclinometer == SensorState::ok && e.against_inclinometer &&
      *e.against_inclinometer > kWildFactor * gates.by_rows[2])
    return true;
  return wheels_ok && e.against_prediction_by_wheels &&
         *e.against_prediction_by_wheels > kWildFactor * gates.by_rows[3];
}

bool is_outvoted(const MotionEvidence& e) {
  return e.forward && e.forward->imu_and_wheels_agree && e.forward->vision_contradicts_imu &&
         e.forward->vision_nis > kOutvoted;
}

}  // namespace

MotionDecision decide(const MotionEvidence& e, const MotionGates& gates) {
  MotionDecision d;
  d.gate = gates.vision;
  if (is_outvoted(e)) {
    d.use = MotionUse::reject;
    d.nis = e.forward->vision_nis;
    d.gate = kOutvoted;
    d.why = HealthReason::outvoted;
    return d;
  }
  const bool wild = is_wild(e, gates);
  if (wild && !e.follows_doubted && !e.keeps_reference && e.vision != SensorState::excluded) {
    d.use = MotionUse::doubt;
    d.nis = std::max(e.nis, kWildFactor * gates.vision);
    d.why = HealthReason::wild;
    return d;
  }
  d.accept_doubted = e.follows_doubted && (wild || e.nis > gates.vision);
  if (!e.predicted_by_imu) {
    d.use = MotionUse::follow;
    d.uncertain = e.is_implausible && !wheels_confirm(e, gates);
    return d;
  }
  d.nis = e.nis;
  if (e.nis <= gates.vision) {
    d.use = MotionUse::correct;
    return d;
  }
  const bool wheels_contradict_imu = e.forward && !e.forward->imu_and_wheels_agree;
  if (e.vision == SensorState::excluded && !wheels_contradict_imu) {
    d.use = MotionUse::reject;
    d.why = HealthReason::disagrees;
    return d;
  }
  d.use = MotionUse::reset;
  d.nis = 0;  // it is the IMU that failed
  return d;
}

bool ends_contradictions(const SensorMonitor& imu, bool velocity_was_reset, const MotionGates& gates) {
  return !(velocity_was_reset && imu.nis > kGrossFactor * gates.vision);
}

}  // namespace spartan::internal
