#include "spartan/core/pose_constraint.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace spartan {

Matrix6d common_share(const Matrix6d& pose, const Matrix6d& map) {
  constexpr double kLeastVariance = 1e-14;  // a pose may be exact
  const Matrix6d root = Eigen::LLT<Matrix6d>(pose + kLeastVariance * Matrix6d::Identity()).matrixL();
  const auto lower = root.triangularView<Eigen::Lower>();
  const Matrix6d half = lower.solve(map), whitened = lower.solve(half.transpose());
  const Eigen::SelfAdjointEigenSolver<Matrix6d> axes(0.5 * (whitened + whitened.transpose()));
  const Vector6d smaller = axes.eigenvalues().cwiseMax(0).cwiseMin(1);
  const Matrix6d common = axes.eigenvectors() * smaller.asDiagonal() * axes.eigenvectors().transpose();
  return lower.transpose().solve(common * root.transpose());
}

}  // namespace spartan
