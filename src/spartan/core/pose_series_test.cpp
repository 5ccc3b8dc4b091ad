// Exponentials and Jacobians against the power series that define them, and the operations of a pose.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <limits>
#include <numbers>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/numerics/random.h"
#include "spartan/testing/laws.h"

namespace spartan {
namespace {

using Exact3 = Eigen::Matrix<long double, 3, 3>;
using Exact4 = Eigen::Matrix<long double, 4, 4>;
using Exact6 = Eigen::Matrix<long double, 6, 6>;

// Σ A^n / (n + from)!: the exponential for from = 0, the left Jacobian for from = 1.
template <class Matrix>
Matrix power_series(const Matrix& a, int from) {
  Matrix term = Matrix::Identity(), sum = term;
  for (int n = 1; n < 60; ++n) {
    term = (term * a / static_cast<long double>(n + from)).eval();
    sum += term;
  }
  return sum;
}

Exact3 exact_skew(const Eigen::Vector3d& v) {
  Exact3 m = Exact3::Zero();
  m(1, 0) = v.z(), m(2, 0) = -v.y(), m(2, 1) = v.x();
  return m - m.transpose().eval();
}

// Around the angles at which closed forms take over from series as well.
std::vector<Eigen::Vector3d> rotation_vectors() {
  std::vector<Eigen::Vector3d> vectors = testing::tricky_rotation_vectors();
  const Eigen::Vector3d axis = Eigen::Vector3d(-0.3, 0.7, 0.5).normalized();
  for (const double angle : {0.99e-4, 1.01e-4, 5e-3, 0.99e-2, 1.01e-2, 0.1, 1.0, 3.1}) vectors.push_back(angle * axis);
  return vectors;
}

TEST(PowerSeries, RotationsAgree) {
  for (const Eigen::Vector3d& v : rotation_vectors()) {
    const Eigen::Matrix3d rotation = power_series<Exact3>(exact_skew(v), 0).cast<double>();
    const Eigen::Matrix3d jacobian = power_series<Exact3>(exact_skew(v), 1).cast<double>();
    EXPECT_LE((exp_so3(v).toRotationMatrix() - rotation).norm(), 2e-15) << v.transpose();
    EXPECT_LE((left_jacobian_so3(v) - jacobian).norm(), 1e-12) << v.transpose();
    EXPECT_LE((left_jacobian_inverse_so3(v) - jacobian.inverse()).norm(), 3e-9) << v.transpose();
    EXPECT_LE((log_so3(exp_so3(v)) - v).norm(), 1e-14 * (1 + v.norm())) << v.transpose();
  }
}

TEST(PowerSeries, TransformsAgree) {
  Random random(5);
  for (const Eigen::Vector3d& v : rotation_vectors()) {
    Vector6d tangent;
    tangent << random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-5, 5), v;
    Exact4 twist = Exact4::Zero();
    twist.topLeftCorner<3, 3>() = exact_skew(v);
    twist.topRightCorner<3, 1>() = tangent.head<3>().cast<long double>();
    EXPECT_LE((exp_se3(tangent).matrix() - power_series<Exact4>(twist, 0).cast<double>()).norm(), 2e-12)
        << tangent.transpose();
    Exact6 ad = Exact6::Zero();
    ad.topLeftCorner<3, 3>() = ad.bottomRightCorner<3, 3>() = exact_skew(v);
    ad.topRightCorner<3, 3>() = exact_skew(tangent.head<3>());
    const Matrix6d jacobian = power_series<Exact6>(-ad, 1).cast<double>();
    EXPECT_LE((right_jacobian_se3(tangent) - jacobian).norm(), 1e-11) << tangent.transpose();
    EXPECT_LE((right_jacobian_inverse_se3(tangent) - jacobian.inverse()).norm(), 1e-7) << tangent.transpose();
  }
}

TEST(PoseOperations, AQuaternionAndItsNegativeAreOneRotation) {
  const Eigen::Vector3d v(0.4, -1.9, 0.7);
  const Eigen::Quaterniond q = exp_so3(v);
  EXPECT_LE((log_so3(Eigen::Quaterniond(-q.coeffs())) - v).norm(), 1e-14);
  EXPECT_NEAR(rotation_angle(Pose(Eigen::Quaterniond(-q.coeffs()), Eigen::Vector3d::Zero())), v.norm(), 1e-14);
}

TEST(PoseOperations, MatrixRoundTrip) {
  Vector6d tangent;
  tangent << 1, -2, 3, 0.3, -0.4, 1.2;
  const Pose pose = exp_se3(tangent);
  const Pose back = Pose::from_matrix(pose.matrix());
  EXPECT_LE((back.matrix() - pose.matrix()).norm(), 1e-15);
  EXPECT_EQ(pose.matrix().row(3), Eigen::RowVector4d(0, 0, 0, 1));
  const Eigen::Vector3d point(0.5, -7, 2);
  EXPECT_LE((pose * point - (pose.matrix() * point.homogeneous()).head<3>()).norm(), 1e-14);
}

TEST(PoseOperations, InterpolationTurnsAtAConstantRate) {
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, -2) / 3;
  const Pose a(exp_so3(0.3 * axis), Eigen::Vector3d(1, 2, 3)), b(exp_so3(1.5 * axis), Eigen::Vector3d(5, 2, -5));
  for (const double fraction : {0.0, 0.25, 0.5, 1.0}) {
    const Pose between = interpolate(a, b, fraction);
    EXPECT_LE((log_so3(between.rotation()) - (0.3 + 1.2 * fraction) * axis).norm(), 1e-14) << fraction;
    EXPECT_LE((between.translation() - Eigen::Vector3d(1 + 4 * fraction, 2, 3 - 8 * fraction)).norm(), 1e-14);
  }
}

TEST(PoseOperations, EveryNumberMustBeFinite) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(Pose().all_finite());
  EXPECT_FALSE(Pose::from_translation({0, kNan, 0}).all_finite());
  EXPECT_FALSE(Pose::from_unit_quaternion({kNan, 0, 0, 0}, Eigen::Vector3d::Zero()).all_finite());
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
  EXPECT_TRUE(is_rotation(matrix));
  matrix(2, 1) = kNan;
  EXPECT_FALSE(is_rotation(matrix));
}

// Of a reflection: the rotation that maximizes the trace of RᵀM, here half a turn about the axis that M keeps best.
TEST(PoseOperations, NearestRotationOfAReflectionIsARotation) {
  const Eigen::Matrix3d mirror = Eigen::Vector3d(-3, -2, -1).asDiagonal();
  const Eigen::Matrix3d nearest = nearest_rotation(mirror);
  EXPECT_TRUE(is_rotation(nearest));
  EXPECT_LE((nearest - Eigen::Matrix3d(Eigen::Vector3d(-1, -1, 1).asDiagonal())).norm(), 1e-14);
}

TEST(PoseOperations, SimilaritiesScalePositionsOnly) {
  const Similarity s{2, Pose(exp_so3({0, 0, std::numbers::pi / 2}), Eigen::Vector3d(1, 0, 0))};
  EXPECT_LE((s * Eigen::Vector3d(1, 0, 3) - Eigen::Vector3d(1, 2, 6)).norm(), 1e-14);
  const Pose moved = s * Pose(exp_so3({0, 0, 0.5}), Eigen::Vector3d(1, 0, 3));
  EXPECT_LE((moved.translation() - Eigen::Vector3d(1, 2, 6)).norm(), 1e-14);
  EXPECT_LE((log_so3(moved.rotation()) - Eigen::Vector3d(0, 0, std::numbers::pi / 2 + 0.5)).norm(), 1e-14);
}

}  // namespace
}  // namespace spartan
