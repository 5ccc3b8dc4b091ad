#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "spartan/core/trajectory.h"

namespace spartan {

PoseConstraint transported(const PoseConstraint& constraint, const UncertainPose& motion, Stamp stamp) {
  // T Exp(ξ) M = T M Exp(Ad(M⁻¹) ξ).
  const Matrix6d back = adjoint(motion.pose), forth = adjoint(motion.pose.inverse());
  return {stamp, constraint.world_from_body * motion.pose,
          inflated(back.transpose() * constraint.information * back, motion.covariance),
          forth * constraint.map_covariance * forth.transpose()};
}

// (Λ⁻¹ + C)⁻¹ = (I + Λ C)⁻¹ Λ, which exists for a Λ of any rank.
Matrix6d inflated(const Matrix6d& information, const Matrix6d& covariance) {
  const Matrix6d m = (Matrix6d::Identity() + information * covariance).partialPivLu().solve(information);
  return 0.5 * (m + m.transpose());
}

Matrix6d shared_fraction(const Matrix6d& pose, const Matrix6d& map) {
  constexpr double kLeastVariance = 1e-14;  // m² or rad²; keeps the covariance of an exact pose invertible
  const Matrix6d root = Eigen::LLT<Matrix6d>(pose + kLeastVariance * Matrix6d::Identity()).matrixL();
  const auto lower = root.triangularView<Eigen::Lower>();
  const Matrix6d half = lower.solve(map), whitened = lower.solve(half.transpose());
  const SymmetricEigen axes = eigen_of_symmetric(0.5 * (whitened + whitened.transpose()));
  const Vector6d smaller = axes.values.cwiseMax(0).cwiseMin(1);
  const Matrix6d common = axes.vectors * smaller.asDiagonal() * axes.vectors.transpose();
  return lower.transpose().solve(common * root.transpose());
}

}  // namespace spartan
