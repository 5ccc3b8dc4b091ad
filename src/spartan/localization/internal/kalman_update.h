// Gating and measurement update of an error-state Kalman filter.
#pragma once

#include <Eigen/Core>

#include "spartan/localization/internal/error_state.h"

namespace spartan::internal {

/// Innovation of a measurement: residual = jacobian · error + noise. At most 6 rows; no heap allocation.
struct Innovation {
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1> residual;
  Eigen::Matrix<double, Eigen::Dynamic, error_at::kSize, Eigen::RowMajor, 6, error_at::kSize> jacobian;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6> noise;  ///< covariance
  /// Cross-covariance of error and noise; no columns if they are independent.
  Eigen::Matrix<double, error_at::kSize, Eigen::Dynamic, 0, error_at::kSize, 6> shared;

  /// All zero.
  explicit Innovation(int rows);
  int rows() const { return static_cast<int>(residual.size()); }
};

/// Normalized innovation squared (NIS), residualᵀ S⁻¹ residual with S = H P Hᵀ + R + H C + Cᵀ Hᵀ and the
/// cross-covariance C of error and noise: chi-square distributed with rows() degrees of freedom for a consistent
/// filter. Infinite if S is not positive definite.
double normalized_innovation_squared(const ErrorCovariance& covariance, const Innovation& innovation);

/// Kalman update with gain (P Hᵀ + C) S⁻¹: covariance in Joseph's form, mean injected by add_error, covariance of the
/// poses transported to the new mean, ξ' = J_r(ξ̂) (ξ − ξ̂) (Solà 2017, section 6.3). Returns false and changes nothing
/// if S is not positive definite.
bool correct(StateEstimate& estimate, const Innovation& innovation);

/// The same, but only the error at `index` is updated; all others are considered (Schmidt 1966). Joseph's form holds
/// for any gain.
bool correct_only(StateEstimate& estimate, const Innovation& innovation, int index);

/// The same, but the `count` errors from `first` on are considered only.
bool correct_all_but(StateEstimate& estimate, const Innovation& innovation, int first, int count);

/// Restores the symmetry that rounding destroys.
void symmetrize(ErrorCovariance& covariance);

}  // namespace spartan::internal
