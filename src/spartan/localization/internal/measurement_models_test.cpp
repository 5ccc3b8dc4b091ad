#include "spartan/localization/internal/measurement_models.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "spartan/localization/internal/drive_test.h"
#include "spartan/testing/numeric_jacobian.h"

namespace spartan::internal {
namespace {

// Residual = measured − expected: its derivative with respect to the error of the estimate is −jacobian.
template <int Rows>
void expect_derivative(const NavigationState& s, const std::function<Innovation(const NavigationState&)>& innovation) {
  const auto numeric = testing::numeric_jacobian<Rows, error_at::kSize>(
      [&](const ErrorVector& e) -> Eigen::Matrix<double, Rows, 1> { return innovation(add_error(s, e)).residual; },
      ErrorVector::Zero(), 1e-4);
  EXPECT_LE((innovation(s).jacobian + numeric).cwiseAbs().maxCoeff(), 1e-6);
}

const Eigen::Vector3d kCentre(0.3, -0.1, 0.2);

TEST(MeasurementModels, JacobiansMatchFiniteDifferences) {
  Random random(4);
  for (int round = 0; round < 10; ++round) {
    const NavigationState s = random_navigation_state(random);
    const Eigen::Vector3d centre = normal3(random, 0.3);
    WheelStep step{0.1, 0.2, true, 1, 1, 1, 1};
    expect_derivative<4>(s, [&](const NavigationState& x) { return wheel_innovation(x, step, centre); });
    step.yaw_known = false;
    expect_derivative<3>(s, [&](const NavigationState& x) { return wheel_innovation(x, step, centre); });
    const double heading = heading_about_up(s) + s.compass_offset_rad + 0.1;
    expect_derivative<1>(s, [&](const NavigationState& x) { return compass_innovation(x, heading, 0.1); });
    const Eigen::Vector2d tilt =
        roll_pitch_of_up(s.world_from_body.rotation().conjugate() * true_up(s.gravity_tilt_rad));
    expect_derivative<2>(s,
                         [&](const NavigationState& x) { return inclinometer_innovation(x, tilt.x(), tilt.y(), 1); });
    expect_derivative<3>(s, [&](const NavigationState& x) { return rest_innovation(x, {1, 2, 3}, 1, 3.71); });
    const auto up = testing::numeric_jacobian<3, error_at::kSize>(
        [&](const ErrorVector& e) -> Eigen::Vector3d { return up_in_body(add_error(s, e), error_at::kVisionClone).up; },
        ErrorVector::Zero());
    EXPECT_LE((up_in_body(s, error_at::kVisionClone).jacobian - up).cwiseAbs().maxCoeff(), 1e-6);
  }
}

TEST(MeasurementModels, ForwardOfStepMatchesItsJacobian) {
  Random random(8);
  const NavigationState s = random_navigation_state(random);
  const auto numeric = testing::numeric_jacobian<1, error_at::kSize>(
      [&](const ErrorVector& e) -> Eigen::Matrix<double, 1, 1> {
        return Eigen::Matrix<double, 1, 1>(forward_since(add_error(s, e), error_at::kStepClone, kCentre).metres);
      },
      ErrorVector::Zero());
  EXPECT_LE((forward_since(s, error_at::kStepClone, kCentre).jacobian - numeric).cwiseAbs().maxCoeff(), 1e-6);
}

// At the estimate: the derivative of the residual, and blind to a shift and a rotation of the whole drive.
TEST(MeasurementModels, RelativeMotionDoesNotMeasureTheWorld) {
  Random random(15);
  const NavigationState s = random_navigation_state(random);
  Vector6d r;
  r << 0.4, -0.3, 0.2, 0.3, -0.2, 0.25;
  const Pose measured = motion_since_clone(s, error_at::kVisionClone).clone_from_body * exp_se3(r);
  MotionErrors errors;
  errors.drift = 0.05 * Matrix6d::Identity();
  for (Eigen::Index i = 0; i < errors.by_calibration.size(); ++i)
    errors.by_calibration.data()[i] = random.uniform(-0.02, 0.02);
  const auto innovation = [&](const NavigationState& x) {
    return relative_motion_innovation(x, error_at::kVisionClone, measured, Matrix6d::Identity(), errors);
  };
  expect_derivative<6>(s, innovation);
  ErrorVector shift = ErrorVector::Zero();
  const Vector6d world = Vector6d::Random();
  shift.segment<6>(error_at::kPose) = adjoint(s.world_from_body.inverse()) * world;
  shift.segment<6>(error_at::kVisionClone) = adjoint(s.world_from_vision_clone.inverse()) * world;
  EXPECT_LE((innovation(s).jacobian * shift).norm(), 1e-12);
}

TEST(MeasurementModels, WheelsPredictTheChordOfAnArc) {
  // A quarter circle of radius 1: the chord √2 lies along the mean attitude, whatever the frame.
  NavigationState s;
  s.wheel_scale = 0.5;
  s.world_from_step_clone = exp_se3((Vector6d() << 1, 2, 3, 0.1, 0.2, 0.3).finished());
  s.world_from_body = s.world_from_step_clone * Pose(exp_so3({0, 0, std::numbers::pi / 2}), Eigen::Vector3d(1, 1, 0));
  const Innovation i =
      wheel_innovation(s, {2 * std::sqrt(2.0), std::numbers::pi / 2, true, 1, 1, 1, 1}, Eigen::Vector3d::Zero());
  EXPECT_LE(i.residual.norm(), 1e-12);
  EXPECT_NEAR(forward_since(s, error_at::kStepClone, Eigen::Vector3d::Zero()).metres, std::sqrt(2.0), 1e-12);
}

// A rover that turns on the spot: away from the turning centre its points move sideways, but no wheel slips.
TEST(MeasurementModels, WheelsMeasureTheTurningCentre) {
  NavigationState s;
  const Pose turned = Pose::from_rotation(exp_so3({0, 0, 0.2}));
  const Pose to_imu = Pose::from_translation(-kCentre);  // the state is at the IMU, the centre at kCentre from it
  s.world_from_step_clone = to_imu;
  s.world_from_body = turned * to_imu;
  const Innovation i = wheel_innovation(s, {0, 0.2, true, 1, 1, 1, 1}, kCentre);
  EXPECT_LE(i.residual.norm(), 1e-12);
  EXPECT_GT(wheel_innovation(s, {0, 0.2, true, 1, 1, 1, 1}, Eigen::Vector3d::Zero()).residual.norm(), 0.05);
}

TEST(MeasurementModels, RollAndPitchMatchTheSimulator) {
  const double roll = 0.2, pitch = -0.3, yaw = 1.1;
  const Eigen::Quaterniond turn = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                                  Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
  const Eigen::Vector3d up = turn.conjugate() * Eigen::Vector3d::UnitZ();
  EXPECT_LE((roll_pitch_of_up(up) - Eigen::Vector2d(roll, pitch)).norm(), 1e-12);
  EXPECT_LE((up_of_roll_pitch(roll, pitch) - up).norm(), 1e-12);
  EXPECT_NEAR(heading_of(Pose::from_rotation(turn)), yaw, 1e-12);
}

TEST(MeasurementModels, CompassResidualIsWrapped) {
  NavigationState s;
  s.compass_offset_rad = 3;
  EXPECT_NEAR(compass_innovation(s, -3, 0.1).residual[0], 2 * std::numbers::pi - 6, 1e-12);
}

TEST(MeasurementModels, PoseConstraintOfAnyRankHasARowForEachDirection) {
  Random random(6);
  const StateEstimate estimate{random_navigation_state(random), ErrorCovariance::Identity()};
  Vector6d offset;
  offset << 0.1, 0.2, 0.3, 0.01, 0.02, 0.03;
  const Pose seen = estimate.state.world_from_body * exp_se3(offset);
  EXPECT_EQ(map_innovation(estimate, error_at::kPose, {{}, seen}, 1).rows(), 0);
  Matrix6d some = Matrix6d::Zero();
  some(0, 0) = 100;
  some(5, 5) = 1e4;
  const Innovation i = map_innovation(estimate, error_at::kPose, {{}, seen, some}, 2);
  ASSERT_EQ(i.rows(), 2);
  // Its information about the error is that of the constraint, transported to the mean and halved by the factor.
  const Matrix6d jacobian = right_jacobian_se3(offset);
  const Matrix6d information =
      (i.jacobian.transpose() * i.noise.inverse() * i.jacobian).block<6, 6>(error_at::kPose, error_at::kPose);
  EXPECT_LE((information - 0.5 * jacobian.transpose() * some * jacobian).cwiseAbs().maxCoeff(), 1e-8);
  // The full residual at full rank.
  const Innovation all = map_innovation(estimate, error_at::kPose, {{}, seen, Matrix6d::Identity()}, 1);
  EXPECT_LE((all.jacobian.leftCols<6>().transpose() * all.residual - offset).norm(), 1e-9);
}

}  // namespace
}  // namespace spartan::internal
