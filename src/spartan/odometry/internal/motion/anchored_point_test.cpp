#include "spartan/odometry/internal/motion/anchored_point.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "spartan/numerics/random.h"
#include "spartan/testing/numeric_jacobian.h"

namespace spartan::internal {
namespace {

const RectifiedStereo kAnchorStereo{{640, 480}, 500, {319.5, 239.5}, 0.12};

struct Case {
  AnchoredPoint point;
  Pose previous_from_current, previous_from_anchor;
};

Case random_case(std::uint32_t seed) {
  Random random(seed);
  const auto tangent = [&] {
    Vector6d t;
    for (int i = 0; i < 6; ++i) t[i] = random.uniform(-0.1, 0.1);
    return t;
  };
  return {{{random.uniform(0, 639), random.uniform(0, 479)}, random.uniform(0, 60)},
          exp_se3(tangent()),
          exp_se3(tangent())};
}

Eigen::Vector3d projected(const Case& c) {
  return project_anchored(kAnchorStereo, c.point, c.previous_from_current.inverse() * c.previous_from_anchor)->measured;
}

RC_GTEST_PROP(AnchoredPoint, AgreesWithTriangulationTransformAndProjection, (std::uint32_t seed)) {
  Case c = random_case(seed);
  c.point.disparity += 0.5;
  const Pose current_from_anchor = c.previous_from_current.inverse() * c.previous_from_anchor;
  const Eigen::Vector3d point =
      current_from_anchor * kAnchorStereo.triangulate(c.point.pixel.x(), c.point.pixel.y(), c.point.disparity);
  RC_PRE(point.z() > 0.1);
  RC_ASSERT((projected(c) - kAnchorStereo.project(point)).norm() < 1e-8);
}

RC_GTEST_PROP(AnchoredPoint, JacobiansAgreeWithNumericalDerivatives, (std::uint32_t seed)) {
  const Case c = random_case(seed);
  const auto p = project_anchored(kAnchorStereo, c.point, c.previous_from_current.inverse() * c.previous_from_anchor);
  RC_PRE(p.has_value());
  RC_PRE(1 / p->by_disparity.z() > 0);
  const auto by_motion = testing::numeric_jacobian<3, 6>(
      [&](const Vector6d& xi) {
        Case moved = c;
        moved.previous_from_current = c.previous_from_current * exp_se3(xi);
        return projected(moved);
      },
      Vector6d::Zero());
  RC_ASSERT((by_motion - p->by_motion).norm() < 1e-5 * (1 + by_motion.norm()));
  const auto by_point = testing::numeric_jacobian<3, 3>(
      [&](const Eigen::Vector3d& change) {
        Case moved = c;
        moved.point.pixel += change.head<2>();
        moved.point.disparity += change.z();
        return projected(moved);
      },
      Eigen::Vector3d::Zero());
  RC_ASSERT((by_point.leftCols<2>() - p->by_anchor_pixel).norm() < 1e-6 * (1 + by_point.norm()));
  RC_ASSERT((by_point.col(2) - p->by_disparity).norm() < 1e-6 * (1 + by_point.norm()));
}

TEST(AnchoredPoint, IsRegularAtInfinityAndRejectsPointsBehindTheCamera) {
  const Pose rotated = exp_se3((Vector6d() << 5, 0, 0, 0, 0.01, 0).finished());
  const auto far = project_anchored(kAnchorStereo, {{319.5, 239.5}, 0.0}, rotated);
  ASSERT_TRUE(far.has_value());
  EXPECT_NEAR(far->measured.x(), 319.5 + 500 * std::tan(0.01), 1e-6);  // only the rotation moves a point at infinity
  EXPECT_EQ(far->measured.z(), 0);
  const Pose driven_past = Pose::from_translation({0, 0, -3});
  EXPECT_FALSE(
      project_anchored(kAnchorStereo, {{300, 200}, 30}, driven_past).has_value());  // 2 m ahead, 3 m driven: now behind
}

TEST(AnchoredPoint, WarpAgreesWithTheProjectionOfAPlane) {
  const AnchoredPoint point{{350, 300}, 20};
  const Eigen::Vector2d slant(0.02, 0.3);
  const Pose motion = exp_se3((Vector6d() << 0.05, 0.02, -0.4, 0.02, -0.03, 0.01).finished());
  const AnchoredWarp warp = warp_of(*project_anchored(kAnchorStereo, point, motion), slant);
  const auto projection_of = [&](const Eigen::Vector2d& offset) {
    return project_anchored(kAnchorStereo, {point.pixel + offset, point.disparity + slant.dot(offset)}, motion)
        ->measured;
  };
  const Eigen::Vector3d centre = projection_of(Eigen::Vector2d::Zero());
  for (const Eigen::Vector2d& offset : {Eigen::Vector2d(0.01, 0), Eigen::Vector2d(0, 0.01)}) {
    const Eigen::Vector3d change = projection_of(offset) - centre;
    EXPECT_LT((change.head<2>() - warp.pixels * offset).norm(), 1e-4 * 0.01 * 10);
    EXPECT_NEAR(change.z(), warp.slant.dot(change.head<2>()), 1e-5);
  }
}

}  // namespace
}  // namespace spartan::internal
