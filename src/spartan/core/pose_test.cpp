#include "spartan/core/pose.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "spartan/numerics/random.h"
#include "spartan/testing/laws.h"
#include "spartan/testing/numeric_jacobian.h"

namespace spartan {
namespace {

std::vector<Vector6d> tricky_tangents() {
  std::vector<Vector6d> samples;
  Random random(7);
  for (const Eigen::Vector3d& rotation : testing::tricky_rotation_vectors()) {
    Vector6d tangent;
    tangent << random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-5, 5), rotation;
    samples.push_back(tangent);
  }
  return samples;
}

TEST(Rotation, ObeysGroupLaws) {
  testing::GroupUnderTest<Eigen::Quaterniond, 3> group{
      exp_so3, log_so3, [](const auto& a, const auto& b) { return Eigen::Quaterniond(a * b); },
      [](const auto& a) { return a.conjugate(); },
      [](const auto& a, const auto& b) { return (a.toRotationMatrix() - b.toRotationMatrix()).norm(); }};
  testing::expect_group_laws<Eigen::Quaterniond, 3>(group, testing::tricky_rotation_vectors(), 1e-9);
}

TEST(Pose, ObeysGroupLaws) {
  testing::GroupUnderTest<Pose, 6> group{exp_se3, log_se3, [](const auto& a, const auto& b) { return a * b; },
                                         [](const auto& a) { return a.inverse(); },
                                         [](const auto& a, const auto& b) { return (a.matrix() - b.matrix()).norm(); }};
  testing::expect_group_laws<Pose, 6>(group, tricky_tangents(), 2e-8);
}

TEST(Similarity, IsScaleRotationAndTranslation) {
  const Similarity s{2.5, exp_se3((Vector6d() << 1, -2, 3, 0.2, -0.4, 0.3).finished())};
  const Eigen::Vector3d point(0.7, -0.2, 0.4);
  Eigen::Matrix4d matrix = s.pose.matrix();
  matrix.topLeftCorner<3, 3>() *= 2.5;
  EXPECT_LE((s * point - (matrix * point.homogeneous()).head<3>()).norm(), 1e-12);
  const Pose other = exp_se3((Vector6d() << 0.3, 0.1, -2, -0.5, 0.1, 0.2).finished());
  EXPECT_LE(((s * other).translation() - s * other.translation()).norm(), 1e-12);
  EXPECT_LE(((s * other).rotation().toRotationMatrix() -
             s.pose.rotation().toRotationMatrix() * other.rotation().toRotationMatrix())
                .norm(),
            1e-12);
}

TEST(Pose, AdjointTransportsAPerturbation) {
  Random random(3);
  for (const Vector6d& tangent : tricky_tangents()) {
    const Pose pose = exp_se3(tangent);
    Vector6d xi;
    for (int i = 0; i < 6; ++i) xi[i] = random.uniform(-0.5, 0.5);
    const Pose left = pose * exp_se3(xi) * pose.inverse();
    EXPECT_LE((left.matrix() - exp_se3(adjoint(pose) * xi).matrix()).norm(), 1e-9);
  }
}

TEST(Pose, JacobiansMatchNumericalDerivatives) {
  for (const Vector6d& tangent : tricky_tangents()) {
    if (tangent.tail<3>().norm() > 3.0) continue;  // numerical derivatives across π mix two branches of the logarithm
    const Pose inverse = exp_se3(tangent).inverse();
    const auto difference = testing::numeric_jacobian<6, 6>(
        [&](const Vector6d& delta) -> Vector6d { return log_se3(inverse * exp_se3(tangent + delta)); },
        Vector6d::Zero(), 1e-3);
    EXPECT_LE((right_jacobian_se3(tangent) - difference).cwiseAbs().maxCoeff(), 1e-7) << tangent.transpose();
    EXPECT_LE((right_jacobian_inverse_se3(tangent) * right_jacobian_se3(tangent) - Matrix6d::Identity()).norm(), 1e-8);
  }
}

// Monte Carlo reference: a propagated covariance equals the covariance of propagated samples.
TEST(Pose, CovariancePropagationAgreesWithSampling) {
  Random random(11);
  Vector6d a_tangent, b_tangent, sigma_a, sigma_b;
  a_tangent << 1, 2, -0.5, 0.3, -0.4, 0.8;
  b_tangent << -2, 0.4, 1, -0.6, 0.1, 0.5;
  sigma_a << 0.01, 0.02, 0.005, 0.004, 0.002, 0.006;
  sigma_b << 0.004, 0.01, 0.02, 0.002, 0.005, 0.001;
  const UncertainPose a{exp_se3(a_tangent), sigma_a.cwiseAbs2().asDiagonal()};
  const UncertainPose b{exp_se3(b_tangent), sigma_b.cwiseAbs2().asDiagonal()};
  const UncertainPose product = compose(a, b), inverse = invert(a);

  Matrix6d sampled_product = Matrix6d::Zero(), sampled_inverse = Matrix6d::Zero();
  const int count = 40000;
  for (int n = 0; n < count; ++n) {
    Vector6d xi_a, xi_b;
    for (int i = 0; i < 6; ++i) xi_a[i] = sigma_a[i] * random.normal();
    for (int i = 0; i < 6; ++i) xi_b[i] = sigma_b[i] * random.normal();
    const Pose noisy_a = a.pose * exp_se3(xi_a), noisy_b = b.pose * exp_se3(xi_b);
    const Vector6d p = log_se3(product.pose.inverse() * noisy_a * noisy_b);
    const Vector6d i = log_se3(inverse.pose.inverse() * noisy_a.inverse());
    sampled_product += p * p.transpose() / count;
    sampled_inverse += i * i.transpose() / count;
  }
  EXPECT_LE((sampled_product - product.covariance).norm(), 0.03 * product.covariance.norm());
  EXPECT_LE((sampled_inverse - inverse.covariance).norm(), 0.03 * inverse.covariance.norm());
}

TEST(Matrix6, DecompositionsReproduceTheMatrix) {
  Random random(3);
  for (int round = 0; round < 20; ++round) {
    Matrix6d m;
    for (double& value : m.reshaped()) value = random.uniform(-1, 1);
    EXPECT_LT((m * inverse_of(m) - Matrix6d::Identity()).norm(), 1e-9 * inverse_of(m).norm());
    const Matrix6d symmetric = m + m.transpose();
    const SymmetricEigen eigen = eigen_of_symmetric(symmetric);
    EXPECT_LT((eigen.vectors * eigen.values.asDiagonal() * eigen.vectors.transpose() - symmetric).norm(), 1e-13);
    EXPECT_TRUE(std::is_sorted(eigen.values.begin(), eigen.values.end()));
  }
}

TEST(Pose, NearestRotationProjectsOntoSO3) {
  const Eigen::Matrix3d exact = exp_so3({0.2, -0.7, 1.1}).toRotationMatrix();
  Eigen::Matrix3d rough = 1.02 * exact;
  rough(0, 1) += 0.01;
  EXPECT_FALSE(is_rotation(rough));
  EXPECT_TRUE(is_rotation(nearest_rotation(rough)));
  EXPECT_LE((nearest_rotation(1.3 * exact) - exact).norm(), 1e-12);
  EXPECT_FALSE(is_rotation(-Eigen::Matrix3d::Identity()));
}

}  // namespace
}  // namespace spartan
