// Group axioms as reusable checks.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <functional>
#include <vector>

namespace spartan::testing {

/// Interface of a Lie group: maps between elements and tangent vectors, and the group operations.
template <class Element, int Dim>
struct GroupUnderTest {
  using Tangent = Eigen::Matrix<double, Dim, 1>;
  std::function<Element(const Tangent&)> exp;
  std::function<Tangent(const Element&)> log;
  std::function<Element(const Element&, const Element&)> compose;
  std::function<Element(const Element&)> inverse;
  std::function<double(const Element&, const Element&)> distance;  ///< 0 for equal elements
};

/// Checks round trip, inverse, identity and associativity for all samples (tangent vectors); angles must be below π.
template <class Element, int Dim>
void expect_group_laws(const GroupUnderTest<Element, Dim>& group,
                       const std::vector<Eigen::Matrix<double, Dim, 1>>& samples, double tolerance) {
  const Element identity = group.exp(Eigen::Matrix<double, Dim, 1>::Zero());
  for (const auto& a_tangent : samples) {
    SCOPED_TRACE(::testing::Message() << "tangent " << a_tangent.transpose());
    const Element a = group.exp(a_tangent);
    EXPECT_LE((group.log(a) - a_tangent).norm(), tolerance * (1 + a_tangent.norm())) << "round trip log(exp)";
    EXPECT_LE(group.distance(group.exp(group.log(a)), a), tolerance) << "round trip exp(log)";
    EXPECT_LE(group.distance(group.compose(a, group.inverse(a)), identity), tolerance) << "inverse on the right";
    EXPECT_LE(group.distance(group.compose(group.inverse(a), a), identity), tolerance) << "inverse on the left";
    EXPECT_LE(group.distance(group.compose(a, identity), a), tolerance) << "identity";
    for (const auto& b_tangent : samples) {
      const Element b = group.exp(b_tangent);
      const Element c = group.exp(0.5 * (a_tangent - b_tangent));
      EXPECT_LE(group.distance(group.compose(group.compose(a, b), c), group.compose(a, group.compose(b, c))),
                10 * tolerance)
          << "associativity with " << b_tangent.transpose();
    }
  }
}

/// Rotation vectors where implementations tend to fail: zero, tiny, ordinary and near π, along the axes and oblique.
inline std::vector<Eigen::Vector3d> tricky_rotation_vectors() {
  std::vector<Eigen::Vector3d> samples{Eigen::Vector3d::Zero()};
  const std::vector<Eigen::Vector3d> axes{Eigen::Vector3d::UnitX(), -Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ(),
                                          Eigen::Vector3d(1, -2, 0.5).normalized(),
                                          Eigen::Vector3d(-0.3, 0.2, 0.9).normalized()};
  for (const double angle : {1e-12, 1e-7, 9e-5, 1.1e-4, 1e-3, 0.0099, 0.0101, 0.3, 1.5, 3.0, 3.14159, 3.1415926}) {
    for (const auto& axis : axes) samples.push_back(angle * axis);
  }
  return samples;
}

}  // namespace spartan::testing
