#include "spartan/core/pose.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>

namespace spartan {
namespace {

// Q(ρ, φ), the upper-right block of the left Jacobian of SE(3), which couples translation and rotation
// (Barfoot & Furgale 2014, eq. 102; Solà eq. 180).
Eigen::Matrix3d coupling(const Eigen::Vector3d& rho, const Eigen::Vector3d& phi) {
  const double squared = phi.squaredNorm();
  const double angle = std::sqrt(squared);
  double a, b, c;
  if (angle < 1e-2) {  // the closed forms lose digits by cancellation; here the series is exact to 1e-13
    a = 1.0 / 6.0 - squared / 120.0 + squared * squared / 5040.0;
    b = 1.0 / 24.0 - squared / 720.0 + squared * squared / 40320.0;
    c = 1.0 / 120.0 - squared / 2520.0 + squared * squared / 120960.0;
  } else {
    const double sine = std::sin(angle), cosine = std::cos(angle);
    a = (angle - sine) / (squared * angle);
    b = (squared + 2.0 * cosine - 2.0) / (2.0 * squared * squared);
    c = (2.0 * angle - 3.0 * sine + angle * cosine) / (2.0 * squared * squared * angle);
  }
  const Eigen::Matrix3d r = skew(rho), p = skew(phi);
  const Eigen::Matrix3d pr = p * r, rp = r * p, prp = pr * p;
  return 0.5 * r + a * (pr + rp + prp) + b * (p * pr + rp * p - 3.0 * prp) + c * (prp * p + p * prp);
}

Matrix6d left_jacobian_se3(const Vector6d& tangent) {
  const Eigen::Vector3d rho = tangent.head<3>(), phi = tangent.tail<3>();
  Matrix6d j = Matrix6d::Zero();
  j.topLeftCorner<3, 3>() = left_jacobian_so3(phi);
  j.bottomRightCorner<3, 3>() = j.topLeftCorner<3, 3>();
  j.topRightCorner<3, 3>() = coupling(rho, phi);
  return j;
}

}  // namespace

Pose Pose::from_matrix(const Eigen::Matrix4d& matrix) {
  return {Eigen::Matrix3d(matrix.topLeftCorner<3, 3>()), matrix.topRightCorner<3, 1>()};
}

Eigen::Matrix4d Pose::matrix() const {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = rotation_matrix();
  m.topRightCorner<3, 1>() = translation_;
  return m;
}

Pose Pose::inverse() const {
  const Eigen::Quaterniond back = rotation_.conjugate();
  return {back, -(back * translation_)};
}

Pose Pose::operator*(const Pose& other) const {
  return {rotation_ * other.rotation_, rotation_ * other.translation_ + translation_};
}

Pose exp_se3(const Vector6d& tangent) {
  const Eigen::Vector3d phi = tangent.tail<3>();
  return {exp_so3(phi), left_jacobian_so3(phi) * tangent.head<3>()};
}

Vector6d log_se3(const Pose& pose) {
  const Eigen::Vector3d phi = log_so3(pose.rotation());
  Vector6d tangent;
  tangent << left_jacobian_inverse_so3(phi) * pose.translation(), phi;
  return tangent;
}

Matrix6d adjoint(const Pose& pose) {
  const Eigen::Matrix3d r = pose.rotation_matrix();
  Matrix6d ad = Matrix6d::Zero();
  ad.topLeftCorner<3, 3>() = r;
  ad.topRightCorner<3, 3>() = skew(pose.translation()) * r;
  ad.bottomRightCorner<3, 3>() = r;
  return ad;
}

Matrix6d right_jacobian_se3(const Vector6d& tangent) {
  return left_jacobian_se3(-tangent);
}

Matrix6d right_jacobian_inverse_se3(const Vector6d& tangent) {
  const Matrix6d j = right_jacobian_se3(tangent);
  const Eigen::Matrix3d inverse = left_jacobian_inverse_so3(-tangent.tail<3>());
  Matrix6d result = Matrix6d::Zero();
  result.topLeftCorner<3, 3>() = inverse;
  result.bottomRightCorner<3, 3>() = inverse;
  result.topRightCorner<3, 3>() = -inverse * j.topRightCorner<3, 3>() * inverse;
  return result;
}

double rotation_angle(const Pose& pose) {
  return 2.0 * std::atan2(pose.rotation().vec().norm(), std::abs(pose.rotation().w()));
}

Pose interpolate(const Pose& a, const Pose& b, double fraction) {
  return {a.rotation().slerp(fraction, b.rotation()), (1.0 - fraction) * a.translation() + fraction * b.translation()};
}

UncertainPose compose(const UncertainPose& a_from_b, const UncertainPose& b_from_c) {
  const Matrix6d ad = adjoint(b_from_c.pose.inverse());
  return {a_from_b.pose * b_from_c.pose, ad * a_from_b.covariance * ad.transpose() + b_from_c.covariance};
}

UncertainPose invert(const UncertainPose& a_from_b) {
  const Matrix6d ad = adjoint(a_from_b.pose);
  return {a_from_b.pose.inverse(), ad * a_from_b.covariance * ad.transpose()};
}

SymmetricEigen eigen_of_symmetric(const Matrix6d& matrix) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(matrix);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Matrix6d inverse_of(const Matrix6d& matrix) {
  return matrix.inverse();
}

}  // namespace spartan
