// Gate and correction of an error-state Kalman filter.
#pragma once

#include <Eigen/Core>

#include "spartan/localization/internal/error_state.h"

namespace spartan {

/// What a measurement says about the error: residual = jacobian · error + noise. At most 6 rows, nothing on the heap.
struct Innovation {
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1> residual;
  Eigen::Matrix<double, Eigen::Dynamic, error_at::kSize, Eigen::RowMajor, 6, error_at::kSize> jacobian;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6> noise;  ///< covariance
  /// Covariance of the error with the noise; no columns where they have nothing in common.
  Eigen::Matrix<double, error_at::kSize, Eigen::Dynamic, 0, error_at::kSize, 6> shared;

  /// All zero.
  explicit Innovation(int rows);
  int rows() const { return static_cast<int>(residual.size()); }
};

/// residualᵀ S⁻¹ residual with S = H P Hᵀ + R + H C + Cᵀ Hᵀ, C what error and noise share: chi-square distributed with
/// rows() degrees of freedom where all is as believed. Infinite where S is not positive definite.
double normalised_square(const ErrorCovariance& covariance, const Innovation& innovation);

/// Kalman correction, gain (P Hᵀ + C) S⁻¹, with the covariance in Joseph's form, the mean injected by add_error, and
/// the covariance of the poses carried over to the new mean: ξ' = J_r(ξ̂) (ξ − ξ̂) (Solà 2017, section 6.3). False, and
/// nothing changed, where S is not positive definite.
bool correct(Belief& belief, const Innovation& innovation);

/// The same where only the error at `index` may learn; all others are considered, not corrected (Schmidt 1966).
/// Joseph's form holds for any gain.
bool correct_only(Belief& belief, const Innovation& innovation, int index);

/// The same where the `count` errors from `first` on are the ones that are only considered.
bool correct_all_but(Belief& belief, const Innovation& innovation, int first, int count);

/// Restores symmetry after many small sums.
void symmetrise(ErrorCovariance& covariance);

}  // namespace spartan
