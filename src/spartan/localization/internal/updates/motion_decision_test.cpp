// Each line of the table of decide(), and each condition that a line depends on.
#include "spartan/localization/internal/updates/motion_decision.h"

#include <gtest/gtest.h>

namespace spartan::internal {
namespace {

/// Gates at 10 for vision and 5 for the others: wild above 40 and 20.
MotionGates gates() {
  MotionGates g;
  g.vision = 10;
  g.by_rows.fill(5);
  return g;
}

MotionEvidence by_imu(double nis) {
  MotionEvidence e;
  e.predicted_by_imu = true;
  e.nis = nis;
  return e;
}

MotionEvidence with_wheels(MotionEvidence e, double against_wheels) {
  e.against_wheels = against_wheels;
  return e;
}

MotionUse use_of(const MotionEvidence& e) {
  return decide(e, gates()).use;
}

TEST(MotionDecision, VisionAloneIsFollowed) {
  const MotionDecision d = decide({}, gates());
  EXPECT_EQ(d.use, MotionUse::follow);
  EXPECT_FALSE(d.uncertain);
  EXPECT_FALSE(d.accept_doubted);
  EXPECT_LE(d.nis, d.gate);
}

TEST(MotionDecision, CorrectsInsideTheGateAndResetsOutside) {
  EXPECT_EQ(use_of(by_imu(9.9)), MotionUse::correct);
  const MotionDecision d = decide(by_imu(10.1), gates());
  EXPECT_EQ(d.use, MotionUse::reset);
  EXPECT_LE(d.nis, d.gate) << "vision passes; it is the IMU that failed";
}

TEST(MotionDecision, DoubtsAWildMotionOnce) {
  MotionEvidence e = by_imu(41);
  const MotionDecision first = decide(e, gates());
  EXPECT_EQ(first.use, MotionUse::doubt);
  EXPECT_EQ(first.why, HealthReason::wild);
  EXPECT_GT(first.nis, first.gate);
  e.follows_doubted = true;
  const MotionDecision second = decide(e, gates());
  EXPECT_EQ(second.use, MotionUse::reset);
  EXPECT_TRUE(second.accept_doubted);
}

TEST(MotionDecision, AnyContradictionAfterADoubtProvesThatTheFirstWasRight) {
  MotionEvidence e = by_imu(11);
  e.follows_doubted = true;
  EXPECT_TRUE(decide(e, gates()).accept_doubted);
  e.nis = 9;
  EXPECT_FALSE(decide(e, gates()).accept_doubted);
  e = with_wheels({}, 21);
  e.follows_doubted = true;
  EXPECT_TRUE(decide(e, gates()).accept_doubted);
}

TEST(MotionDecision, NeverDoubtsWhatTheNextMotionContainsNorExcludedVision) {
  MotionEvidence e = by_imu(41);
  e.keeps_reference = true;
  EXPECT_EQ(use_of(e), MotionUse::reset);
  e = by_imu(41);
  e.vision = SensorState::excluded;
  EXPECT_EQ(use_of(e), MotionUse::reject);
}

TEST(MotionDecision, OnlyAnImuThatIsOkMakesAMotionWild) {
  for (const SensorState imu : {SensorState::suspect, SensorState::excluded}) {
    MotionEvidence e = by_imu(41);
    e.imu = imu;
    EXPECT_EQ(use_of(e), MotionUse::reset);
  }
}

TEST(MotionDecision, WheelsDecideBetweenVisionAndImu) {
  EXPECT_EQ(use_of(with_wheels(by_imu(41), 4)), MotionUse::reset) << "they confirm vision";
  EXPECT_EQ(use_of(with_wheels(by_imu(1), 21)), MotionUse::doubt) << "they contradict it";
  MotionEvidence e = with_wheels(by_imu(41), 4);
  e.wheels = SensorState::excluded;
  EXPECT_EQ(use_of(e), MotionUse::reset) << "excluded wheels confirm";
  e = with_wheels(by_imu(1), 21);
  e.wheels = SensorState::excluded;
  EXPECT_EQ(use_of(e), MotionUse::correct) << "but do not contradict";
}

TEST(MotionDecision, WheelsInThePredictionAreAWitnessWithoutAnImu) {
  MotionEvidence e = with_wheels({}, 4);
  e.against_prediction_by_wheels = 21;
  EXPECT_EQ(use_of(e), MotionUse::doubt);
  e.against_prediction_by_wheels = 19;
  EXPECT_EQ(use_of(e), MotionUse::follow);
  e.against_prediction_by_wheels = 21;
  e.wheels = SensorState::suspect;
  EXPECT_EQ(use_of(e), MotionUse::follow);
}

TEST(MotionDecision, AnInclinometerThatIsOkIsAWitnessWithoutAnImu) {
  MotionEvidence e;
  e.against_inclinometer = 21;
  EXPECT_EQ(use_of(e), MotionUse::doubt);
  e.against_inclinometer = 19;
  EXPECT_EQ(use_of(e), MotionUse::follow);
  e.against_inclinometer = 21;
  e.inclinometer = SensorState::suspect;
  EXPECT_EQ(use_of(e), MotionUse::follow);
}

TEST(MotionDecision, OutvotedOnlyByTwoThatAgreeAndBothDiffer) {
  const auto with = [](bool agree, bool contradicts, double nis) {
    MotionEvidence e = by_imu(1);
    e.forward = ForwardComparison{agree, contradicts, nis};
    return e;
  };
  const MotionDecision d = decide(with(true, true, 26), gates());
  EXPECT_EQ(d.use, MotionUse::reject);
  EXPECT_EQ(d.why, HealthReason::outvoted);
  EXPECT_GT(d.nis, d.gate);
  EXPECT_EQ(use_of(with(false, true, 26)), MotionUse::correct);
  EXPECT_EQ(use_of(with(true, false, 26)), MotionUse::correct);
  EXPECT_EQ(use_of(with(true, true, 24)), MotionUse::correct);
}

TEST(MotionDecision, ExcludedVisionResetsThePredictionOnlyWithTheWheels) {
  MotionEvidence e = by_imu(11);
  e.vision = SensorState::excluded;
  const MotionDecision alone = decide(e, gates());
  EXPECT_EQ(alone.use, MotionUse::reject);
  EXPECT_EQ(alone.why, HealthReason::disagrees);
  EXPECT_GT(alone.nis, alone.gate);
  e.forward = ForwardComparison{false, true, 30};
  EXPECT_EQ(use_of(e), MotionUse::reset);
  e.forward = ForwardComparison{true, false, 1};
  EXPECT_EQ(use_of(e), MotionUse::reject);
}

TEST(MotionDecision, AnImplausibleMotionIsUncertainUnlessAnotherSensorConfirmsIt) {
  MotionEvidence e;
  e.is_implausible = true;
  EXPECT_EQ(use_of(e), MotionUse::follow);
  EXPECT_TRUE(decide(e, gates()).uncertain);
  EXPECT_FALSE(decide(with_wheels(e, 4), gates()).uncertain);
  EXPECT_TRUE(decide(with_wheels(e, 6), gates()).uncertain);
  MotionEvidence predicted = by_imu(1);
  predicted.is_implausible = true;
  EXPECT_FALSE(decide(predicted, gates()).uncertain);
}

TEST(MotionDecision, AGrossContradictionIsNotEndedByAgreementWithAResetVelocity) {
  SensorMonitor imu;
  imu.nis = 1001;
  EXPECT_FALSE(ends_contradictions(imu, true, gates()));
  EXPECT_TRUE(ends_contradictions(imu, false, gates()));
  imu.nis = 999;
  EXPECT_TRUE(ends_contradictions(imu, true, gates()));
}

}  // namespace
}  // namespace spartan::internal
