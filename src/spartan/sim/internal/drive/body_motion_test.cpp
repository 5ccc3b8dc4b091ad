#include "spartan/sim/internal/drive/body_motion.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "spartan/rig/rig.h"
#include "spartan/sim/internal/drive/motion_sensors.h"

namespace spartan::sim::internal {
namespace {

struct SimulatedDrive {
  Drive drive;
  TerrainShape shape;
  BodyMotion motion;
};

SimulatedDrive simulate_drive(const PathOptions& path, const TerrainShapeOptions& terrain = {}) {
  auto drive = Drive::plan(path, {}, Rig());
  TerrainShape shape(terrain, 4);
  BodyMotion motion(*drive, {shape, WheelLift()}, {}, ThreadPool(1));
  return {std::move(*drive), shape, motion};
}

TEST(BodyMotion, DerivativesMatchFiniteDifferencesOfThePose) {
  const SimulatedDrive r = simulate_drive({.kind = PathKind::winding, .length_m = 3, .wavelength_m = 3});
  constexpr double kStep = 1e-3;
  for (double t = 3; t < r.motion.seconds() - 2; t += 3.37) {
    const Pose before = r.motion.world_from_body(t - kStep), here = r.motion.world_from_body(t),
               after = r.motion.world_from_body(t + kStep);
    const Eigen::Vector3d velocity = (after.translation() - before.translation()) / (2 * kStep);
    EXPECT_LT((velocity - r.motion.velocity(t)).norm(), 1e-5);
    const Eigen::Vector3d acceleration = (r.motion.velocity(t + kStep) - r.motion.velocity(t - kStep)) / (2 * kStep);
    EXPECT_LT((acceleration - r.motion.acceleration(t)).norm(), 1e-3);
    const Vector6d twist = log_se3(before.inverse() * after) / (2 * kStep);
    EXPECT_LT((twist.tail<3>() - r.motion.angular_velocity(t)).norm(), 1e-5);
    EXPECT_LT((here.translation() - before.translation()).norm(), 1e-3);
  }
}

TEST(BodyMotion, OnAPlaneTheBodyHasItsNormalAndHeight) {
  TerrainShapeOptions plane;
  plane.relief_m = plane.ripple_height_m = plane.dune_height_m = 0;
  plane.slope_deg = 10;
  plane.slope_heading_deg = 30;
  const TerrainShape shape(plane, 1);
  for (const double heading_deg : {0.0, 30.0, 120.0, -60.0}) {
    const double heading = heading_deg * std::numbers::pi / 180;
    const Vector6d at = fit_to_ground({shape, WheelLift()}, {}, {0.5, -0.2, heading});
    const Eigen::Quaterniond attitude = Eigen::AngleAxisd(at[5], Eigen::Vector3d::UnitZ()) *
                                        Eigen::AngleAxisd(at[4], Eigen::Vector3d::UnitY()) *
                                        Eigen::AngleAxisd(at[3], Eigen::Vector3d::UnitX());
    const double rise = std::tan(10 * std::numbers::pi / 180);
    const Eigen::Vector3d normal =
        Eigen::Vector3d(-rise * std::cos(std::numbers::pi / 6), -rise * std::sin(std::numbers::pi / 6), 1).normalized();
    EXPECT_LT((attitude * Eigen::Vector3d::UnitZ() - normal).norm(), 1e-9) << heading_deg;
    EXPECT_NEAR(at[2], shape.height(0.5, -0.2), 1e-9);
  }
}

// Strapdown integration of error-free samples by the midpoint rule.
TEST(Imu, SamplesWithoutErrorsIntegrateToTheTruePath) {
  constexpr double kGravity = 3.71;
  const SimulatedDrive r =
      simulate_drive({.kind = PathKind::winding, .length_m = 2, .swing_deg = 30, .wavelength_m = 2});
  ImuOptions perfect;
  perfect.rate_hz = 200;
  perfect.gyro_noise_rad_s_sqrt_hz = perfect.gyro_bias_rad_s = perfect.gyro_walk_rad_s2_sqrt_hz = 0;
  perfect.accel_noise_m_s2_sqrt_hz = perfect.accel_bias_m_s2 = perfect.accel_walk_m_s3_sqrt_hz = 0;
  const auto samples = measure_imu(r.motion, perfect, kGravity, {}, 1);
  ASSERT_GT(samples.size(), 5000U);
  Eigen::Quaterniond attitude = r.motion.world_from_body(0).rotation();
  Eigen::Vector3d velocity = r.motion.velocity(0), position = r.motion.world_from_body(0).translation();
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const double dt = seconds_between(samples[i - 1].stamp, samples[i].stamp);
    const Eigen::Vector3d rate = 0.5 * (samples[i - 1].gyro_rad_s + samples[i].gyro_rad_s);
    const Eigen::Quaterniond next = (attitude * exp_so3(Eigen::Vector3d(rate * dt))).normalized();
    const Eigen::Vector3d force =
        0.5 * (attitude * samples[i - 1].accel_m_s2 + next * samples[i].accel_m_s2) - Eigen::Vector3d(0, 0, kGravity);
    position += velocity * dt + 0.5 * force * dt * dt;
    velocity += force * dt;
    attitude = next;
  }
  const double end = seconds_between(samples.front().stamp, samples.back().stamp);
  const Pose truth = r.motion.world_from_body(end);
  fmt::print("IMU without errors: position error {:.2f} mm after {:.0f} s\n",
             1000 * (position - truth.translation()).norm(), end);
  EXPECT_LT((position - truth.translation()).norm(), 0.01) << "over " << end << " s";
  EXPECT_LT(rotation_angle(Pose(attitude, position).inverse() * Pose(truth.rotation(), position)), 1e-5);
}

TEST(Imu, FaultsDropOrFreezeSamplesAndLeaveOthersUnchanged) {
  const SimulatedDrive r = simulate_drive({.kind = PathKind::straight, .length_m = 0.5});
  const auto whole = measure_imu(r.motion, {}, 3.71, {}, 7);
  const auto dropped = measure_imu(r.motion, {}, 3.71, {{MotionSensor::imu, SensorFaultKind::drop, 1, 2}}, 7);
  const auto frozen = measure_imu(r.motion, {}, 3.71, {{MotionSensor::imu, SensorFaultKind::freeze, 1, 2}}, 7);
  EXPECT_EQ(dropped.size(), whole.size() - 100);
  ASSERT_EQ(frozen.size(), whole.size());
  EXPECT_EQ(frozen[150].gyro_rad_s, whole[99].gyro_rad_s);
  EXPECT_EQ(frozen[200].gyro_rad_s, whole[200].gyro_rad_s);
  EXPECT_EQ(dropped.back().accel_m_s2, whole.back().accel_m_s2);
  EXPECT_TRUE(measure_imu(r.motion, {.enabled = false}, 3.71, {}, 7).empty());
}

// The overlapping Allan deviation of a stationary gyroscope: white noise N/√τ at one second.
TEST(Imu, AllanDeviationMatchesTheNoiseDensity) {
  const SimulatedDrive r = simulate_drive({.kind = PathKind::stationary, .stationary_s = 400});
  ImuOptions noisy;
  noisy.gyro_bias_rad_s = 0.01;
  noisy.gyro_walk_rad_s2_sqrt_hz = 0;
  const auto samples = measure_imu(r.motion, noisy, 3.71, {}, 3);
  const std::size_t m = 100;  // one second
  std::vector<double> angle(1, 0.0);
  for (const ImuSample& s : samples) angle.push_back(angle.back() + s.gyro_rad_s.x() / noisy.rate_hz);
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i + 2 * m < angle.size(); ++i, ++count)
    sum += std::pow(angle[i + 2 * m] - 2 * angle[i + m] + angle[i], 2);
  const double allan = std::sqrt(sum / (2.0 * static_cast<double>(count)));
  EXPECT_NEAR(allan, noisy.gyro_noise_rad_s_sqrt_hz, 0.1 * noisy.gyro_noise_rad_s_sqrt_hz);
}

ImuOptions without_noise() {
  ImuOptions imu;
  imu.gyro_noise_rad_s_sqrt_hz = imu.gyro_bias_rad_s = imu.gyro_walk_rad_s2_sqrt_hz = 0;
  imu.accel_noise_m_s2_sqrt_hz = imu.accel_bias_m_s2 = imu.accel_walk_m_s3_sqrt_hz = 0;
  return imu;
}

// At a distance r from the axis of a turn the acceleration is that of the second derivative of the position.
TEST(Imu, PositionAddsTheAccelerationOfTheLeverArm) {
  const SimulatedDrive r = simulate_drive({.kind = PathKind::turn_in_place, .turn_deg = 180, .turn_rate_deg_s = 40});
  ImuOptions imu = without_noise();
  imu.position_m = {0.3, -0.2, 0.4};
  const Eigen::Vector3d arm(0.3, -0.2, 0.4);
  const auto samples = measure_imu(r.motion, imu, 3.71, {}, 1);
  double largest = 0;
  for (std::size_t i = 100; i + 100 < samples.size(); i += 7) {
    const double t = seconds_between(samples[0].stamp, samples[i].stamp), h = 0.002;
    const auto place = [&](double time_s) { return Eigen::Vector3d(r.motion.world_from_body(time_s) * arm); };
    const Eigen::Vector3d acceleration = (place(t + h) - 2 * place(t) + place(t - h)) / (h * h);
    const Eigen::Vector3d force = r.motion.world_from_body(t).rotation().conjugate() *
                                  Eigen::Vector3d(acceleration + Eigen::Vector3d(0, 0, 3.71));
    EXPECT_LT((samples[i].accel_m_s2 - force).norm(), 5e-3) << t;
    largest = std::max(largest, (samples[i].accel_m_s2 - true_imu(r.motion, t, 3.71).accel_m_s2).norm());
  }
  EXPECT_GT(largest, 0.1);
}

TEST(Imu, ScaleMisalignmentAndDelayAreConstantsOfTheDrive) {
  const SimulatedDrive r = simulate_drive({.kind = PathKind::turn_in_place, .turn_deg = 90, .turn_rate_deg_s = 20});
  const auto samples_of = [&](const ImuOptions& imu, std::uint64_t seed) {
    return measure_imu(r.motion, imu, 3.71, {}, seed);
  };
  const auto exact = samples_of(without_noise(), 1);
  ImuOptions scaled = without_noise(), tilted = without_noise(), late = without_noise(), stepped = without_noise();
  scaled.scale_percent = 2;
  tilted.misalignment_deg = 1;
  late.delay_ms = 20;
  stepped.gyro_step_rad_s = 0.01;
  double scale_squares = 0, tilt_squares = 0;
  constexpr int kSeeds = 200;
  for (int seed = 0; seed < kSeeds; ++seed) {
    const auto a = samples_of(scaled, static_cast<std::uint64_t>(seed)),
               b = samples_of(tilted, static_cast<std::uint64_t>(seed));
    scale_squares += std::pow(a[300].gyro_rad_s.z() / exact[300].gyro_rad_s.z() - 1, 2);
    EXPECT_NEAR(a[350].gyro_rad_s.z() / exact[350].gyro_rad_s.z(), a[300].gyro_rad_s.z() / exact[300].gyro_rad_s.z(),
                1e-9);
    tilt_squares += std::pow((b[300].gyro_rad_s.x() - exact[300].gyro_rad_s.x()) / exact[300].gyro_rad_s.z(), 2);
  }
  EXPECT_NEAR(std::sqrt(scale_squares / kSeeds), 0.02, 0.004);
  EXPECT_NEAR(std::sqrt(tilt_squares / kSeeds), std::numbers::pi / 180, 0.25 * std::numbers::pi / 180);
  EXPECT_EQ(samples_of(late, 1)[302].gyro_rad_s, exact[300].gyro_rad_s) << "two samples at 100 Hz";
  const double step = samples_of(stepped, 1)[300].gyro_rad_s.z() / 0.01;
  EXPECT_NEAR(step, std::round(step), 1e-9);
}

TEST(Imu, VibrationGrowsWithSpeed) {
  ImuOptions imu = without_noise();
  imu.accel_vibration_1_s = 5;
  const auto deviation = [&](double speed) {
    const SimulatedDrive r = simulate_drive({.kind = PathKind::straight, .length_m = 20 * speed, .speed_m_s = speed});
    const auto samples = measure_imu(r.motion, imu, 3.71, {}, 1);
    double squares = 0;
    for (std::size_t i = 600; i < 1600; ++i) {
      const double t = seconds_between(samples[0].stamp, samples[i].stamp);
      squares += std::pow(samples[i].accel_m_s2.y() - true_imu(r.motion, t, 3.71).accel_m_s2.y(), 2);
    }
    return std::sqrt(squares / 1000);
  };
  EXPECT_NEAR(deviation(0.1), 0.5, 0.04);
  EXPECT_NEAR(deviation(0.2), 1.0, 0.08);
}

TEST(Wheels, RolledDistanceFollowsTheSlipModel) {
  TerrainShapeOptions slope;
  slope.relief_m = slope.ripple_height_m = slope.dune_height_m = 0;
  slope.slope_deg = 12;
  const SimulatedDrive up = simulate_drive({.kind = PathKind::straight, .length_m = 3}, slope);
  WheelOptions wheels;
  wheels.slip_sand = wheels.radius_error = wheels.resolution_m = 0;
  wheels.slip_level = 0.05;
  wheels.slip_by_slope = 1.5;
  const auto samples = measure_wheels(up.motion, {}, wheels, {}, 1);
  const double travelled = 3 / std::cos(12 * std::numbers::pi / 180),
               slip = 0.05 + 1.5 * std::tan(12 * std::numbers::pi / 180);
  EXPECT_NEAR(samples.back().left_m, travelled / (1 - slip), 0.01);
  EXPECT_NEAR(samples.back().right_m, samples.back().left_m, 1e-6);
  const SimulatedDrive turn = simulate_drive({.kind = PathKind::turn_in_place, .turn_deg = 90});
  const auto turned = measure_wheels(
      turn.motion, {}, {.slip_level = 0, .slip_by_slope = 0, .slip_sand = 0, .radius_error = 0, .resolution_m = 0}, {},
      1);
  EXPECT_NEAR(turned.back().right_m - turned.back().left_m, 0.6 * std::numbers::pi / 2, 0.01);
}

TEST(Compass, MeasuresTheHeadingWithItsErrors) {
  const SimulatedDrive r = simulate_drive({.kind = PathKind::turn_in_place, .turn_deg = 90, .turn_rate_deg_s = 1});
  const auto exact = measure_compass(r.motion, {.sigma_deg = 0, .bias_deg = 0, .outlier_fraction = 0}, {}, 1);
  EXPECT_NEAR(exact.front().heading_rad, 0, 1e-6);
  EXPECT_NEAR(exact.back().heading_rad, std::numbers::pi / 2, 1e-3);
  const auto tilt = measure_inclinometer(r.motion, {.sigma_deg = 0, .bias_deg = 0}, {}, 1);
  EXPECT_NEAR(tilt.back().roll_rad, r.motion.roll_pitch_yaw(r.motion.seconds()).x(), 1e-3);
  const auto wild = measure_compass(r.motion, {.sigma_deg = 0, .bias_deg = 0, .outlier_fraction = 0.5}, {}, 1);
  int outliers = 0;
  for (std::size_t i = 0; i < wild.size(); ++i)
    outliers += std::abs(wild[i].heading_rad - exact[i].heading_rad) > 0.05 ? 1 : 0;
  EXPECT_NEAR(outliers, 0.5 * static_cast<double>(wild.size()), 0.2 * static_cast<double>(wild.size()));
}

TerrainShapeOptions slope_to_the_left() {
  TerrainShapeOptions plane;
  plane.relief_m = plane.ripple_height_m = plane.dune_height_m = 0;
  plane.slope_deg = 15;
  plane.slope_heading_deg = 90;
  return plane;
}

TEST(BodyMotion, SideSlipTurnsTheHeadingUphillAndKeepsThePath) {
  const auto drive = Drive::plan({.kind = PathKind::straight, .length_m = 3}, {}, Rig());
  const TerrainShape shape(slope_to_the_left(), 4);
  const WheelOptions slipping{.side_slip = 0.4};
  const BodyMotion motion(*drive, {shape, WheelLift()}, {}, ThreadPool(1), slipping);
  const double crab = std::atan(0.4 * std::tan(15 * std::numbers::pi / 180));
  for (double t = 4; t < motion.seconds() - 3; t += 5) {
    EXPECT_NEAR(motion.roll_pitch_yaw(t).z(), crab, 0.002);
    const Eigen::Vector3d v = motion.velocity(t);
    EXPECT_NEAR(v.y(), 0, 1e-4) << "along the path";
    EXPECT_NEAR((motion.world_from_body(t).rotation().conjugate() * v).y(), -v.norm() * std::sin(crab), 2e-3)
        << "sideways, downhill";
  }
}

TEST(BodyMotion, CreepsDownhillAtRestAndComesBackToThePath) {
  PathOptions path{.kind = PathKind::straight, .length_m = 12};
  path.initial_stop_s = 20;
  const auto drive = Drive::plan(path, {}, Rig());
  const TerrainShape shape(slope_to_the_left(), 4);
  const BodyMotion motion(*drive, {shape, WheelLift()}, {}, ThreadPool(1), {.creep_m_s = 0.002});
  const double rate = 0.002 * std::tan(15 * std::numbers::pi / 180);
  const auto left_m = [&](double t) { return motion.world_from_body(t).translation().y(); };
  EXPECT_NEAR(left_m(15) - left_m(5), -10 * rate, 1e-4);
  EXPECT_LT(left_m(20), -0.009);
  EXPECT_NEAR(left_m(motion.seconds() - 1), 0, 5e-4);
}

TEST(Wheels, StandStillWhileTheRoverCreeps) {
  const PathOptions path{.kind = PathKind::straight, .length_m = 2, .initial_stop_s = 20};
  const auto drive = Drive::plan(path, {}, Rig());
  TerrainShapeOptions ahead = slope_to_the_left();
  ahead.slope_heading_deg = 0;
  const TerrainShape shape(ahead, 4);
  const WheelOptions wheels{
      .slip_level = 0, .slip_by_slope = 0, .slip_sand = 0, .creep_m_s = 0.002, .radius_error = 0, .resolution_m = 0};
  const BodyMotion motion(*drive, {shape, WheelLift()}, {}, ThreadPool(1), wheels);
  EXPECT_LT(motion.world_from_body(19).translation().x(), -0.009);
  for (const WheelSample& sample : measure_wheels(motion, {}, wheels, {}, 1)) {
    if (sample.stamp < stamp_at(19)) {
      EXPECT_NEAR(sample.left_m, 0, 1e-5);
    }
  }
}

TEST(Wheels, SkidMakesThemRollMoreInTurnsAlone) {
  const auto rolled = [](const PathOptions& path, double skid) {
    const auto drive = Drive::plan(path, {}, Rig());
    TerrainShapeOptions level = slope_to_the_left();
    level.slope_deg = 0;
    const TerrainShape shape(level, 4);
    const BodyMotion motion(*drive, {shape, WheelLift()}, {}, ThreadPool(1));
    const WheelOptions wheels{.slip_level = 0, .slip_sand = 0, .turn_skid = skid, .radius_error = 0, .resolution_m = 0};
    return measure_wheels(motion, {}, wheels, {}, 1).back();
  };
  const PathOptions straight{.kind = PathKind::straight, .length_m = 2},
      turn{.kind = PathKind::turn_in_place, .turn_deg = 90};
  EXPECT_NEAR(rolled(straight, 0.2).right_m, rolled(straight, 0).right_m, 1e-9);
  EXPECT_NEAR(rolled(turn, 0.2).right_m, 1.2 * rolled(turn, 0).right_m, 1e-6);
  EXPECT_NEAR(rolled(turn, 0).right_m, std::numbers::pi / 2 * 0.3, 1e-3);
}

TEST(Drive, CanBeginWithoutRest) {
  PathOptions path{.kind = PathKind::straight, .length_m = 1};
  const double with_rest = Drive::plan(path, {}, Rig())->seconds();
  path.initial_stop_s = 0;
  EXPECT_NEAR(Drive::plan(path, {}, Rig())->seconds(), with_rest - 2, 1e-9);
}

}  // namespace
}  // namespace spartan::sim::internal
