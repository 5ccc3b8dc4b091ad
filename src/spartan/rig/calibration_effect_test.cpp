#include <gtest/gtest.h>

#include "spartan/numerics/random.h"
#include "spartan/rig/rig.h"

namespace spartan {
namespace {

Rig one_pair(bool on_mast) {
  Rig rig;
  rig.cameras.resize(2);
  rig.cameras[0].name = "left";
  rig.cameras[1].name = "right";
  for (Camera& camera : rig.cameras) camera.mount = on_mast ? "mast" : "body";
  rig.pairs = {{"pair", "left", "right"}};
  return rig;
}

const Pose kBodyFromLeft(exp_so3({0.1, 0.6, -0.2}), {0.3, 0.06, 0.8});

// Of motions by a camera whose mount and scale have errors, transported with the calibration.
Matrix6d sampled(const Pose& body_motion, const CalibrationErrors& errors, double pan_tilt_deg) {
  Random random(3);
  const auto normal = [&](double sigma) {
    return Eigen::Vector3d(random.normal(0, sigma), random.normal(0, sigma), random.normal(0, sigma));
  };
  constexpr int kSamples = 20000;
  Matrix6d sum = Matrix6d::Zero();
  for (int i = 0; i < kSamples; ++i) {
    Vector6d shift;
    shift << normal(1e-3 * errors.mount_mm),
        normal(kRadiansPerDegree * std::hypot(errors.mount_rotation_deg, pan_tilt_deg));
    const Pose true_body_from_left = kBodyFromLeft * exp_se3(shift);
    const Pose motion = true_body_from_left.inverse() * body_motion * true_body_from_left;
    const double scale = 0.01 * errors.scale_percent;
    const Pose seen(exp_so3((1 + random.normal(0, scale)) * log_so3(motion.rotation())),
                    (1 + random.normal(0, scale)) * motion.translation());
    const Vector6d error = log_se3(body_motion.inverse() * (kBodyFromLeft * seen * kBodyFromLeft.inverse()));
    sum += error * error.transpose();
  }
  return sum / kSamples;
}

Matrix6d calibration_covariance(const Pose& motion, const Rig& rig, const CalibrationErrors& errors) {
  const CalibrationEffect effect = calibration_effect(motion, kBodyFromLeft, rig, rig.pairs[0], errors);
  return effect * effect.transpose();
}

void expect_near(const Matrix6d& covariance, const Matrix6d& expected) {
  const Vector6d sigma = expected.diagonal().cwiseSqrt();
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j)
      EXPECT_NEAR(covariance(i, j), expected(i, j), 0.04 * sigma[i] * sigma[j] + 1e-18) << i << ", " << j;
  }
}

TEST(CalibrationEffect, IsThatOfSampledErrors) {
  const CalibrationErrors errors{0.025, 0.3, 0.15, 2, 0.1};
  for (const Pose& motion :
       {Pose::from_translation({0.1, 0, 0}), Pose(exp_so3({0.02, 0.01, 0.17}), {0.05, -0.02, 0.01})}) {
    expect_near(calibration_covariance(motion, one_pair(false), errors), sampled(motion, errors, 0));
    expect_near(calibration_covariance(motion, one_pair(true), errors), sampled(motion, errors, errors.pan_tilt_deg));
  }
}

TEST(CalibrationEffect, IsZeroAtRestAndOfTheScaleAloneWhereTheBodyIsTheCamera) {
  Rig rig = one_pair(false);
  const CalibrationErrors errors;
  EXPECT_TRUE(calibration_covariance(Pose(), rig, errors).isZero(1e-30));
  rig.convention = PoseConvention::left_optical;
  Matrix6d expected = Matrix6d::Zero();
  expected(0, 0) = 0.01 * errors.scale_percent * 0.01 * errors.scale_percent;
  EXPECT_TRUE(calibration_covariance(Pose::from_translation({1, 0, 0}), rig, errors).isApprox(expected, 1e-9));
}

}  // namespace
}  // namespace spartan
