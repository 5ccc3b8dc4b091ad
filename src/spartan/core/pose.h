// The rotation group SO(3), rigid transforms SE(3), and their uncertainty.
//
// A transform is named `a_from_b`: p_a = a_from_b * p_b. A tangent vector is ξ = (translation ρ, rotation φ), in m and
// rad; perturbations are applied on the right: T ⊕ ξ = T · Exp(ξ) with the full SE(3) exponential.
// Sources: Solà, Deray, Atchuthan, "A micro Lie theory for state estimation in robotics", 2018, appendices B and D;
// Barfoot & Furgale, "Associating uncertainty with three-dimensional poses for use in estimation problems", T-RO 2014.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <numbers>

namespace spartan {

inline constexpr double kRadiansPerDegree = std::numbers::pi / 180;
inline constexpr double kDegreesPerRadian = 180 / std::numbers::pi;

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

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

// Decompositions of covariances and information matrices. They are compiled once: Eigen's templates take seconds each.
/// Eigenvalues of a symmetric matrix in ascending order, and its eigenvectors as columns.
struct SymmetricEigen {
  Vector6d values;
  Matrix6d vectors;
};
SymmetricEigen eigen_of_symmetric(const Matrix6d& matrix);
/// The inverse by LU decomposition with partial pivoting; not finite for a singular matrix.
Matrix6d inverse_of(const Matrix6d& matrix);

/// A rigid transform with a unit quaternion and a translation in metres.
class Pose {
 public:
  Pose() = default;  ///< identity
  Pose(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation)
      : rotation_(rotation.normalized()), translation_(translation) {}
  /// `rotation` must be a rotation matrix; see is_rotation() and nearest_rotation() for data from files.
  Pose(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation)
      : Pose(Eigen::Quaterniond(rotation), translation) {}
  static Pose from_rotation(const Eigen::Quaterniond& rotation) { return {rotation, Eigen::Vector3d::Zero()}; }
  static Pose from_translation(const Eigen::Vector3d& translation) {
    return {Eigen::Quaterniond::Identity(), translation};
  }
  /// Uses the quaternion without normalization, so that stored values are restored bit for bit; it must have unit
  /// length.
  static Pose from_unit_quaternion(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation) {
    Pose pose;
    pose.rotation_ = rotation;
    pose.translation_ = translation;
    return pose;
  }
  /// From the upper 3×4 part of a homogeneous matrix.
  static Pose from_matrix(const Eigen::Matrix4d& matrix);

  const Eigen::Quaterniond& rotation() const { return rotation_; }
  const Eigen::Vector3d& translation() const { return translation_; }
  Eigen::Matrix3d rotation_matrix() const { return rotation_.toRotationMatrix(); }
  Eigen::Matrix4d matrix() const;

  Pose inverse() const;
  Pose operator*(const Pose& other) const;
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const { return rotation_ * point + translation_; }

  bool all_finite() const { return rotation_.coeffs().allFinite() && translation_.allFinite(); }

 private:
  Eigen::Quaterniond rotation_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation_ = Eigen::Vector3d::Zero();
};

/// Exp: ξ = (ρ, φ) → transform with translation J_l(φ) ρ and rotation Exp(φ) (Solà eq. 172).
Pose exp_se3(const Vector6d& tangent);
/// Log: inverse of exp_se3 for rotation angles up to π.
Vector6d log_se3(const Pose& pose);
/// Ad_T with T Exp(ξ) T⁻¹ = Exp(Ad_T ξ) (Solà eq. 175).
Matrix6d adjoint(const Pose& pose);
/// J_r(ξ) with Exp(ξ + δ) ≈ Exp(ξ) Exp(J_r δ) (Solà eq. 179), and its inverse.
Matrix6d right_jacobian_se3(const Vector6d& tangent);
Matrix6d right_jacobian_inverse_se3(const Vector6d& tangent);

/// The rotation angle of a pose, in [0, π] rad.
double rotation_angle(const Pose& pose);

/// Interpolates the translation linearly and the rotation by slerp; fraction 0 gives a, 1 gives b.
Pose interpolate(const Pose& a, const Pose& b, double fraction);

/// A transform with the 6×6 covariance of its right perturbation, order (translation, rotation), in m² and rad².
struct UncertainPose {
  Pose pose;
  Matrix6d covariance = Matrix6d::Zero();
};

/// Composition a_from_b · b_from_c for independent errors, to first order: Σ = Ad(c_from_b) Σ_ab Adᵀ + Σ_bc.
UncertainPose compose(const UncertainPose& a_from_b, const UncertainPose& b_from_c);
/// The inverse b_from_a; Σ' = Ad(a_from_b) Σ Adᵀ.
UncertainPose invert(const UncertainPose& a_from_b);

/// A similarity transform x ↦ s R x + t. Applied to a pose, the scale acts on the position only.
struct Similarity {
  double scale = 1;
  Pose pose;  ///< R, t (metres)

  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return scale * (pose.rotation() * point) + pose.translation();
  }
  Pose operator*(const Pose& other) const { return {pose.rotation() * other.rotation(), *this * other.translation()}; }
};

}  // namespace spartan
