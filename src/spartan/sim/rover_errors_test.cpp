// Draws of the differences between calibration and rover.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/sim/internal/drive/camera_poses.h"
#include "spartan/sim/scenario.h"
#include "spartan/testing/real_data.h"

namespace spartan::sim {
namespace {

using internal::CameraPoses;

Rig shipped() {
  return read_rig_yaml(testing::source_folder() + "/config/rigs/rover_square.yaml").value();
}

const Camera& camera(const Rig& rig, const std::string& name) {
  return *rig.find_camera(name);
}

// The standard deviation of a quantity over many rovers, and the same of its mean.
struct Spread {
  double sigma = 0, mean = 0;
};
Spread spread_of(const RoverErrorOptions& errors, const std::function<double(const Rig&)>& quantity) {
  constexpr int kRovers = 2000;
  double sum = 0, squares = 0;
  for (int seed = 0; seed < kRovers; ++seed) {
    RoverErrorOptions drawn = errors;
    drawn.seed = seed;
    const double value = quantity(true_rig(shipped(), drawn, 1));
    sum += value;
    squares += value * value;
  }
  const double mean = sum / kRovers;
  return {std::sqrt(squares / kRovers - mean * mean), mean};
}

// 2000 draws give a standard deviation to 1.6 %.
constexpr double kTolerance = 0.06;

Eigen::Vector3d pair_turn_deg(const Rig& rig, const std::string& pair) {
  const Pose nominal = shipped().right_from_left(*rig.find_pair(pair));
  const Pose drawn = rig.right_from_left(*rig.find_pair(pair));
  return log_so3((nominal.rotation() * drawn.rotation().conjugate()).normalized()) * kDegreesPerRadian;
}

TEST(RoverErrors, ExactRoverIsTheRigBitForBit) {
  EXPECT_EQ(true_rig(shipped(), rover_errors(RoverGrade::exact), 5), shipped());
  EXPECT_EQ(true_rig(shipped(), RoverErrorOptions{.seed = 3}, 5), shipped());
}

TEST(RoverErrors, EachErrorHasItsStandardDeviationAndChangesNothingElse) {
  for (int axis = 0; axis < 3; ++axis) {
    const Spread turn =
        spread_of({.pair_rotation_deg = 0.5}, [&](const Rig& rig) { return pair_turn_deg(rig, "wide")[axis]; });
    EXPECT_NEAR(turn.sigma, 0.5, 0.5 * kTolerance) << axis;
    EXPECT_NEAR(turn.mean, 0, 0.05) << axis;
  }
  const auto baseline_mm = [](const Rig& rig) { return 1e3 * rig.right_from_left(rig.pairs[1]).translation().norm(); };
  EXPECT_NEAR(spread_of({.baseline_percent = 1}, baseline_mm).sigma, 1.2, 1.2 * kTolerance);
  EXPECT_LT(spread_of({.mount_rotation_deg = 1, .mount_mm = 5}, baseline_mm).sigma, 1e-9) << "pairs move as a whole";
  const auto focal = [](const std::string& name) {
    return [name](const Rig& rig) { return std::get<PinholeModel>(camera(rig, name).model).fx / 492.7568; };
  };
  EXPECT_NEAR(spread_of({.focal_percent = 1}, focal("narrow_left")).sigma, 0.01, 0.01 * kTolerance);
  EXPECT_NEAR(spread_of({.focal_difference_percent = 1}, focal("narrow_right")).sigma, 0.01, 0.01 * kTolerance);
  const auto difference = [&](const Rig& rig) { return focal("narrow_left")(rig) - focal("narrow_right")(rig); };
  EXPECT_LT(spread_of({.focal_percent = 1}, difference).sigma, 1e-12);
  const auto row = [](const std::string& name) {
    return [name](const Rig& rig) { return std::get<PinholeModel>(camera(rig, name).model).cy; };
  };
  EXPECT_NEAR(spread_of({.centre_px = 2}, row("wide_left")).sigma, 2, 2 * kTolerance);
  EXPECT_NEAR(spread_of({.row_offset_px = 2}, row("wide_right")).sigma, 2, 2 * kTolerance);
  EXPECT_LT(spread_of({.row_offset_px = 2}, row("wide_left")).sigma, 1e-9);
}

TEST(RoverErrors, MountsMoveWithTheirPairs) {
  const RoverErrorOptions errors{.mount_rotation_deg = 1, .mount_mm = 5};
  for (const char* name : {"narrow_left", "wide_right"}) {
    SCOPED_TRACE(name);
    const Pose nominal = shipped().body_from_camera(name);
    const auto turn_deg = [&](const Rig& rig) {
      return log_so3((rig.body_from_camera(name).rotation() * nominal.rotation().conjugate()).normalized()).y() *
             kDegreesPerRadian;
    };
    EXPECT_NEAR(spread_of(errors, turn_deg).sigma, 1, kTolerance);
  }
  const Eigen::Vector3d nominal = shipped().body_from_camera("narrow_left").translation();
  const auto shift_mm = [&](const Rig& rig) {
    return 1e3 * (rig.body_from_camera("narrow_left").translation() - nominal).z();
  };
  EXPECT_NEAR(spread_of(errors, shift_mm).sigma, 5, 5 * kTolerance) << "rotations are about the left camera";
}

// A point that the calibration projects to the corner is recorded there plus the drawn distortion.
TEST(RoverErrors, DistortionIsThatOfTheImageCorner) {
  const Camera nominal = camera(shipped(), "wide_left");
  const Eigen::Vector3d corner = unproject(nominal.model, {0, 0})->direction;
  const Eigen::Vector2d centre(559.5, 559.5);
  const auto shift_px = [&](const Rig& rig) {
    return (*project(camera(rig, "wide_left").model, corner) - centre).norm() - centre.norm();
  };
  EXPECT_NEAR(spread_of({.distortion_px = 0.5}, shift_px).sigma, 0.5, 0.5 * kTolerance);
}

TEST(RoverErrors, GradeSetsWhatIsNotGiven) {
  const RoverErrorOptions ordinary = rover_errors(RoverGrade::ordinary);
  EXPECT_GT(ordinary.pair_rotation_deg, 0);
  const auto scenario = parse_scenario("rover: ordinary\nrover_errors: {seed: 4, drift_deg: 0}\n", "s");
  ASSERT_TRUE(scenario) << scenario.error().message();
  RoverErrorOptions expected = ordinary;
  expected.seed = 4;
  expected.drift_deg = 0;
  EXPECT_EQ(scenario->rover_errors, expected);
  const auto again = parse_scenario(dump_options(*scenario), "again");
  EXPECT_EQ(again->rover_errors, expected);
  EXPECT_EQ(parse_scenario("seed: 3\n", "s")->rover_errors, RoverErrorOptions{});
  const auto set = set_scenario_option(*set_scenario_option(Scenario(), "rover=poor"), "rover_errors.mount_mm=1");
  ASSERT_TRUE(set) << set.error().message();
  EXPECT_EQ(set->rover_errors.mount_mm, 1);
  EXPECT_EQ(set->rover_errors.drift_deg, rover_errors(RoverGrade::poor).drift_deg);
  EXPECT_FALSE(set_scenario_option(Scenario(), "rover=bad"));
}

TEST(RoverErrors, TheRecordingStatesTheirStandardDeviations) {
  EXPECT_EQ(calibration_errors({}), (CalibrationErrors{0, 0, 0, 0, 0}));
  const CalibrationErrors usual,
      ordinary = calibration_errors(set_scenario_option(Scenario(), "rover=ordinary").value().rover_errors);
  EXPECT_NEAR(ordinary.pair_rotation_deg, usual.pair_rotation_deg, 0.003);
  EXPECT_NEAR(ordinary.scale_percent, usual.scale_percent, 0.01);
  EXPECT_EQ(ordinary.mount_rotation_deg, usual.mount_rotation_deg);
  EXPECT_EQ(ordinary.mount_mm, usual.mount_mm);
  EXPECT_NEAR(ordinary.pan_tilt_deg, usual.pan_tilt_deg, 0.01);
}

TEST(ImuGrades, SetWhatIsNotGiven) {
  const auto scenario = parse_scenario("imu: {grade: mems, rate_hz: 200, gyro_bias_rad_s: 0.001}\n", "s");
  ASSERT_TRUE(scenario) << scenario.error().message();
  EXPECT_EQ(scenario->imu.rate_hz, 200);
  EXPECT_EQ(scenario->imu.gyro_bias_rad_s, 0.001);
  EXPECT_EQ(scenario->imu.accel_bias_m_s2, imu_of_grade(ImuGrade::mems).accel_bias_m_s2);
  EXPECT_EQ(parse_scenario("imu: {rate_hz: 50}\n", "s")->imu.accel_bias_m_s2, ImuOptions().accel_bias_m_s2);
  EXPECT_EQ(dump_options(*parse_scenario(dump_options(*scenario), "again")), dump_options(*scenario));
  const auto set = set_scenario_option(Scenario(), "imu.grade=tactical");
  EXPECT_EQ(set->imu.gyro_bias_rad_s, imu_of_grade(ImuGrade::tactical).gyro_bias_rad_s);
}

TEST(CameraPoses, PanAndTiltHaveABiasAndANoiseOfEachPositioning) {
  const Rig rig = shipped();
  const PlannedFrame first{10, "wide", 1, 0.5, 0.6}, second{12, "wide", 1, -0.5, 0.6};
  const CameraPoses exact(rig, {}, 1, 100);
  EXPECT_EQ(exact.angles("mast", first).pan_rad, 0.5);
  const CameraPoses biased(rig, {.pan_tilt_bias_deg = 1}, 1, 100);
  const double bias = biased.angles("mast", first).pan_rad - 0.5;
  EXPECT_NE(bias, 0);
  EXPECT_DOUBLE_EQ(biased.angles("mast", second).pan_rad + 0.5, bias) << "constant over the drive";
  double squares = 0;
  const CameraPoses noisy(rig, {.pan_tilt_noise_deg = 1}, 1, 100);
  constexpr int kStops = 2000;
  for (int i = 0; i < kStops; ++i) {
    const double error = noisy.angles("mast", {0.5 * i, "wide", i, 0.1, 0.6}).tilt_rad - 0.6;
    squares += error * error;
  }
  EXPECT_NEAR(std::sqrt(squares / kStops) * kDegreesPerRadian, 1, kTolerance);
  EXPECT_EQ(noisy.angles("mast", first).pan_rad, noisy.angles("mast", first).pan_rad);
  EXPECT_NE(noisy.angles("mast", first).pan_rad - 0.5, noisy.angles("mast", second).pan_rad + 0.5);
}

TEST(CameraPoses, RightCamerasDriftLinearly) {
  const Rig rig = shipped();
  const StereoPair& pair = *rig.find_pair("narrow");
  const CameraPoses poses(rig, {.drift_deg = 1}, 1, 100);
  const PlannedFrame frame{60, "narrow", 3, 0, 0};
  const auto turn = [&](double time_s) {
    const Pose right_from_left = poses.body_from_camera("narrow_right", frame, time_s).inverse() *
                                 poses.body_from_camera("narrow_left", frame, time_s);
    return log_so3((rig.right_from_left(pair).rotation() * right_from_left.rotation().conjugate()).normalized());
  };
  EXPECT_LT(turn(0).norm(), 1e-12);
  EXPECT_GT(turn(100).norm(), 1e-3);
  EXPECT_LT((turn(50) - 0.5 * turn(100)).norm(), 1e-9);
  EXPECT_EQ(poses.body_from_camera("narrow_left", frame, 60).matrix(), rig.body_from_camera("narrow_left").matrix());
}

}  // namespace
}  // namespace spartan::sim
