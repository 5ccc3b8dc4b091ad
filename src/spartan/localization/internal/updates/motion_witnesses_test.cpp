#include "spartan/localization/internal/updates/motion_witnesses.h"

#include <gtest/gtest.h>

#include "spartan/localization/internal/updates/started_memory_test.h"

namespace spartan::internal {
namespace {

VisualMotion motion_of(double forward_m, double roll_rad = 0) {
  RelativeMotion m;
  m.from = start_stamp();
  m.to = after_start(1);
  m.measured = true;
  m.previous_from_current = {Eigen::Quaterniond(Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitX())),
                             {forward_m, 0, 0}};
  m.covariance = test_motion_covariance();
  return VisualMotion::of_imu(m, LeverArm(Eigen::Vector3d::Zero()));
}

// One second after the last frame; the wheels have counted 0.1 m since, the inclinometer has not changed.
FilterMemory memory_of_a_step() {
  FilterMemory memory = started_memory(test_options(), {false, true, false, true});
  memory.vision.has_wheels = memory.vision.has_tilt = true;
  memory.vision.wheels = {start_stamp(), 0, 0};
  memory.wheels.previous = {after_start(0.9), 0.09, 0.09};
  memory.wheels.last = {after_start(1), 0.1, 0.1};
  memory.vision.tilt = {start_stamp(), 0.02, 0.01, 0.003};
  memory.inclinometer.known = true;
  memory.inclinometer.last = {after_start(1), 0.02, 0.01, 0.003};
  memory.stamp = after_start(1);
  return memory;
}

TEST(MotionWitnesses, WheelsCompareTheDistance) {
  const MotionWitnesses witnesses(test_options());
  FilterMemory memory = memory_of_a_step();
  EXPECT_LT(*witnesses.compare_with_wheels(memory, motion_of(0.1)), 0.1);
  // σ of the distance: 12 % and 2 mm of the step, 10 % of the scale of the wheels.
  const double sigma = std::sqrt(std::pow(0.012, 2) + std::pow(0.002, 2) + std::pow(0.01, 2));
  EXPECT_NEAR(*witnesses.compare_with_wheels(memory, motion_of(0.6)), std::pow(0.5 / sigma, 2), 2);
  memory.vision.has_wheels = false;
  EXPECT_FALSE(witnesses.compare_with_wheels(memory, motion_of(0.6)));
}

TEST(MotionWitnesses, InclinometerComparesTheRotation) {
  const MotionWitnesses witnesses(test_options());
  FilterMemory memory = memory_of_a_step();
  EXPECT_LT(*witnesses.compare_with_inclinometer(memory, motion_of(0.1)), 1e-6);
  EXPECT_NEAR(*witnesses.compare_with_inclinometer(memory, motion_of(0.1, 0.05)), 0.0025 / (2 * 9e-6), 2);
  memory.inclinometer.last.stamp = after_start(0.4);  // old
  EXPECT_FALSE(witnesses.compare_with_inclinometer(memory, motion_of(0.1)));
}

// The readings disagree with good motions: they get less weight.
TEST(MotionWitnesses, NoiseOfTheInclinometerIsLearned) {
  FilterMemory memory = memory_of_a_step();
  MotionEvidence evidence;
  evidence.against_inclinometer = 18;  // nine times the two degrees of freedom
  for (int i = 0; i < 100; ++i) learn_inclinometer(memory.inclinometer, evidence);
  EXPECT_GT(memory.inclinometer.of_motions.factor(), 4);
}

TEST(MotionWitnesses, EvidenceIsThatOfTheSensorsPresent) {
  const MotionWitnesses witnesses(test_options());
  FilterMemory memory = memory_of_a_step();
  const Innovation innovation(6);
  memory.vision.constant_velocity_s = 1;
  MotionEvidence e = witnesses.evidence_of(memory, motion_of(0.1), innovation);
  EXPECT_FALSE(e.predicted_by_imu);
  EXPECT_TRUE(e.against_wheels && e.against_inclinometer);
  EXPECT_FALSE(e.forward || e.follows_doubted || e.is_implausible);
  memory.vision.constant_velocity_s = 0;
  memory.vision.doubted = true;
  memory.vision.doubted_at = start_stamp();
  e = witnesses.evidence_of(memory, motion_of(0.1), innovation);
  EXPECT_TRUE(e.predicted_by_imu && e.forward && e.follows_doubted);
  EXPECT_FALSE(e.against_inclinometer);
}

// IMU and wheels say 0.1 m, vision something else.
TEST(MotionWitnesses, DistancesOfAllThreeAreCompared) {
  const MotionWitnesses witnesses(test_options());
  FilterMemory memory = memory_of_a_step();
  memory.estimate.covariance.diagonal().head<3>().setConstant(1e-6);
  memory.estimate.state.world_from_body =
      memory.estimate.state.world_from_vision_clone * Pose::from_translation({0.1, 0, 0});
  const auto right = witnesses.compare_forward(memory, motion_of(0.1)),
             wrong = witnesses.compare_forward(memory, motion_of(0.02));
  EXPECT_TRUE(right->imu_and_wheels_agree && wrong->imu_and_wheels_agree);
  EXPECT_FALSE(right->vision_contradicts_imu);
  EXPECT_TRUE(wrong->vision_contradicts_imu);
  EXPECT_LT(right->vision_nis, 0.1);
  EXPECT_GT(wrong->vision_nis, 1000);
}

}  // namespace
}  // namespace spartan::internal
