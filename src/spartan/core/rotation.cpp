#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>

#include "spartan/core/pose.h"

namespace spartan {
namespace {

// Below this squared angle the Taylor series are exact to double precision.
constexpr double kSmallSquaredAngle = 1e-8;

}  // namespace

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Eigen::Quaterniond exp_so3(const Eigen::Vector3d& rotation_vector) {
  const double squared = rotation_vector.squaredNorm();
  double real, scale;  // q = (real, scale · vector)
  if (squared < kSmallSquaredAngle) {
    scale = 0.5 - squared / 48.0;
    real = 1.0 - squared / 8.0;
  } else {
    const double angle = std::sqrt(squared);
    scale = std::sin(0.5 * angle) / angle;
    real = std::cos(0.5 * angle);
  }
  Eigen::Quaterniond q;
  q.w() = real;
  q.vec() = scale * rotation_vector;
  return q.normalized();
}

Eigen::Vector3d log_so3(const Eigen::Quaterniond& rotation) {
  // 2·atan2(|v|, w) is accurate at all angles; acos(w) loses half of the digits near 0.
  const double sign = rotation.w() < 0 ? -1.0 : 1.0;
  const Eigen::Vector3d v = sign * rotation.vec();
  const double w = sign * rotation.w();
  const double n = v.norm();
  if (n * n < kSmallSquaredAngle) {
    return (2.0 / w) * (1.0 - n * n / (3.0 * w * w)) * v;
  }
  return (2.0 * std::atan2(n, w) / n) * v;
}

Eigen::Matrix3d left_jacobian_so3(const Eigen::Vector3d& rotation_vector) {
  const double squared = rotation_vector.squaredNorm();
  double a, b;  // 1 + a [θ]× + b [θ]×²
  if (squared < kSmallSquaredAngle) {
    a = 0.5 - squared / 24.0;
    b = 1.0 / 6.0 - squared / 120.0;
  } else {
    const double angle = std::sqrt(squared);
    const double half_sine = std::sin(0.5 * angle);
    a = 2.0 * half_sine * half_sine / squared;  // (1 − cos θ) / θ² without cancellation
    b = (angle - std::sin(angle)) / (squared * angle);
  }
  const Eigen::Matrix3d k = skew(rotation_vector);
  return Eigen::Matrix3d::Identity() + a * k + b * k * k;
}

Eigen::Matrix3d left_jacobian_inverse_so3(const Eigen::Vector3d& rotation_vector) {
  const double squared = rotation_vector.squaredNorm();
  double b;  // 1 − ½ [θ]× + b [θ]×²
  if (squared < kSmallSquaredAngle) {
    b = 1.0 / 12.0 + squared / 720.0;
  } else {
    const double half = 0.5 * std::sqrt(squared);
    b = (1.0 - half * std::cos(half) / std::sin(half)) / squared;
  }
  const Eigen::Matrix3d k = skew(rotation_vector);
  return Eigen::Matrix3d::Identity() - 0.5 * k + b * k * k;
}

bool is_rotation(const Eigen::Matrix3d& matrix, double tolerance) {
  if (!matrix.allFinite()) return false;
  const Eigen::Matrix3d residual = matrix.transpose() * matrix - Eigen::Matrix3d::Identity();
  return residual.cwiseAbs().maxCoeff() <= tolerance && matrix.determinant() > 0;
}

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

}  // namespace spartan
