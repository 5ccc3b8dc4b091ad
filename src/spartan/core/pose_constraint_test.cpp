#include "spartan/core/pose_constraint.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "spartan/core/random.h"

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
  return pose * common_share(pose, map);
}

TEST(CommonShare, IsTheMapsWhereThePoseHasDriftedSince) {
  Random random(3);
  for (int i = 0; i < 20; ++i) {
    const Matrix6d map = random_covariance(random), pose = map + random_covariance(random);
    EXPECT_LE((common_covariance(pose, map) - map).norm(), 1e-9 * map.norm());
    EXPECT_LE((common_covariance(map, pose) - map).norm(), 1e-9 * map.norm()) << "whichever came first";
  }
}

TEST(CommonShare, IsNeverMoreThanEither) {
  Random random(4);
  for (int i = 0; i < 20; ++i) {
    const Matrix6d map = random_covariance(random), pose = random_covariance(random),
                   common = common_covariance(pose, map);
    EXPECT_GE(least_eigenvalue(pose - common), -1e-10);
    EXPECT_GE(least_eigenvalue(map - common), -1e-10);
    EXPECT_GE(least_eigenvalue(common), -1e-10);
  }
}

TEST(CommonShare, AnExactPoseOrMapHasNoError) {
  Random random(5);
  const Matrix6d some = random_covariance(random);
  EXPECT_LE(common_covariance(Matrix6d::Zero(), some).norm(), 1e-12);
  EXPECT_LE(common_covariance(some, Matrix6d::Zero()).norm(), 1e-12);
}

}  // namespace
}  // namespace spartan
