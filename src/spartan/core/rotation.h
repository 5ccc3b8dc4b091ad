// The rotation group SO(3): exponential, logarithm and Jacobians.
// Source: Solà, Deray, Atchuthan, "A micro Lie theory for state estimation in robotics", 2018, appendix B.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace spartan {

/// The skew-symmetric matrix [v]× with [v]× w = v × w.
Eigen::Matrix3d skew(const Eigen::Vector3d& v);

/// Exp: rotation vector (axis · angle, rad) → unit quaternion.
Eigen::Quaterniond exp_so3(const Eigen::Vector3d& rotation_vector);

/// Log: the rotation vector with angle in [0, π], the inverse of exp_so3. Accurate near 0 and near π.
Eigen::Vector3d log_so3(const Eigen::Quaterniond& rotation);

/// Left Jacobian J_l(θ): Exp(θ + δ) ≈ Exp(J_l(θ) δ) Exp(θ) (eq. 145). The right one is J_r(θ) = J_l(−θ).
Eigen::Matrix3d left_jacobian_so3(const Eigen::Vector3d& rotation_vector);
/// J_l(θ)⁻¹ (eq. 146); defined for angles below 2π.
Eigen::Matrix3d left_jacobian_inverse_so3(const Eigen::Vector3d& rotation_vector);

/// Whether |RᵀR − I| ≤ `tolerance` per element and det R > 0.
bool is_rotation(const Eigen::Matrix3d& matrix, double tolerance = 1e-6);
/// The rotation nearest to the matrix in the Frobenius norm (by SVD).
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix);

}  // namespace spartan
