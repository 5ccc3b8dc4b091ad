#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "spartan/core/trajectory.h"
#include "spartan/numerics/random.h"

namespace spartan {
namespace {

Matrix6d random_covariance(Random& random) {
  Matrix6d root;
  for (Eigen::Index i = 0; i < root.size(); ++i) root.data()[i] = random.normal(0, 0.1);
  return root * root.transpose();
}

double least_eigenvalue(const Matrix6d& m) {
  return Eigen::SelfAdjointEigenSolver<Matrix6d>(0.5 * (m + m.transpose())).eigenvalues()[0];
}

Matrix6d common_covariance(const Matrix6d& pose, const Matrix6d& map) {
  return pose * shared_fraction(pose, map);
}

TEST(SharedFraction, IsTheMapCovarianceIfThePoseHasDriftedSince) {
  Random random(3);
  for (int i = 0; i < 20; ++i) {
    const Matrix6d map = random_covariance(random), pose = map + random_covariance(random);
    EXPECT_LE((common_covariance(pose, map) - map).norm(), 1e-9 * map.norm());
    EXPECT_LE((common_covariance(map, pose) - map).norm(), 1e-9 * map.norm()) << "symmetric in both";
  }
}

TEST(SharedFraction, IsBoundedByBothCovariances) {
  Random random(4);
  for (int i = 0; i < 20; ++i) {
    const Matrix6d map = random_covariance(random), pose = random_covariance(random),
                   common = common_covariance(pose, map);
    EXPECT_GE(least_eigenvalue(pose - common), -1e-10);
    EXPECT_GE(least_eigenvalue(map - common), -1e-10);
    EXPECT_GE(least_eigenvalue(common), -1e-10);
  }
}

TEST(SharedFraction, IsZeroForAnExactPoseOrMap) {
  Random random(5);
  const Matrix6d some = random_covariance(random);
  EXPECT_LE(common_covariance(Matrix6d::Zero(), some).norm(), 1e-12);
  EXPECT_LE(common_covariance(some, Matrix6d::Zero()).norm(), 1e-12);
}

TEST(PoseConstraint, IsTransportedAlongAMotion) {
  // Compared with the numerical Jacobian of the errors: T Exp(ξ) M Exp(n) = T M Exp(Ad(M⁻¹) ξ + n) to first order.
  Random random(8);
  const auto small = [&](double size) {
    Vector6d v;
    for (int i = 0; i < 6; ++i) v[i] = random.normal(0, size);
    return v;
  };
  PoseConstraint c{{5}, exp_se3(small(1)), Matrix6d::Zero(), random_covariance(random)};
  const Matrix6d covariance = random_covariance(random);
  c.information = covariance.inverse();
  const UncertainPose motion{exp_se3(small(1)), random_covariance(random)};
  const PoseConstraint on = transported(c, motion, {9});
  EXPECT_EQ(on.stamp, Stamp{9});
  EXPECT_LE(log_se3(on.world_from_body.inverse() * c.world_from_body * motion.pose).norm(), 1e-12);
  Matrix6d by_error;
  for (int i = 0; i < 6; ++i) {
    const Vector6d step = 1e-6 * Vector6d::Unit(i);
    by_error.col(i) = log_se3(on.world_from_body.inverse() * c.world_from_body * exp_se3(step) * motion.pose) / 1e-6;
  }
  const Matrix6d expected = by_error * covariance * by_error.transpose() + motion.covariance;
  EXPECT_LE((on.information.inverse() - expected).norm(), 1e-5 * expected.norm());
  const Matrix6d map = by_error * c.map_covariance * by_error.transpose();
  EXPECT_LE((on.map_covariance - map).norm(), 1e-5 * map.norm());
  // Zero information remains zero.
  c.information.setZero();
  EXPECT_EQ(transported(c, motion, {9}).information.norm(), 0);
}

}  // namespace
}  // namespace spartan
