#include "spartan/reconstruction/internal/calibration_variance.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "spartan/core/pose.h"
#include "spartan/numerics/random.h"

namespace spartan::internal {
namespace {

Eigen::Vector3d normal_vector(Random& random, double sigma) {
  return {random.normal(0, sigma), random.normal(0, sigma), random.normal(0, sigma)};
}

// Rotates, shifts and stretches the view of a plane and measures by how much its elevation changes at the cell.
double sampled_variance_m2(const CellSight& cell, const CalibrationErrors& errors) {
  Random random(7);
  constexpr int kSamples = 20000;
  const double degree = kRadiansPerDegree;
  double squares = 0;
  for (int i = 0; i < kSamples; ++i) {
    const Eigen::Vector3d turn =
        normal_vector(random, errors.mount_rotation_deg * degree) + normal_vector(random, errors.pan_tilt_deg * degree);
    const Eigen::Vector3d shift = normal_vector(random, 1e-3 * errors.mount_mm);
    const double yaw = random.normal(0, errors.pair_rotation_deg * degree);
    // With the disparity d = f b / r, an error f yaw of d changes the range to b / (b / r + yaw).
    const double range = cell.from_camera_m.norm();
    const double stretch =
        cell.baseline_m / (cell.baseline_m + range * yaw) * (1 + random.normal(0, 0.01 * errors.scale_percent));
    const Eigen::Vector3d seen = exp_so3(turn) * (stretch * cell.from_camera_m) + shift;
    const Eigen::Vector3d normal = exp_so3(turn) * Eigen::Vector3d(-cell.slope.x(), -cell.slope.y(), 1);
    // Elevation of the plane through `seen` at the place of the cell.
    const Eigen::Vector2d aside = (cell.from_camera_m - seen).head<2>();
    const double z = seen.z() - normal.head<2>().dot(aside) / normal.z();
    squares += std::pow(z - cell.from_camera_m.z(), 2);
  }
  return squares / kSamples;
}

TEST(CalibrationVariance, IsThatOfSampledErrors) {
  for (const Eigen::Vector2d& slope : {Eigen::Vector2d(0, 0), Eigen::Vector2d(0.3, -0.1)}) {
    const CellSight cell{{2.5, 1.0, -1.1}, 0.5, slope};
    for (int part = 0; part < 6; ++part) {
      const CalibrationErrors all;
      const auto only = [&](int index, double value) { return part == 5 || part == index ? value : 0; };
      const CalibrationErrors errors{only(0, all.pair_rotation_deg), only(1, all.scale_percent),
                                     only(2, all.mount_rotation_deg), only(3, all.mount_mm), only(4, all.pan_tilt_deg)};
      const double expected = sampled_variance_m2(cell, errors);
      EXPECT_NEAR(calibration_variance_m2(cell, errors), expected, 0.05 * expected) << "part " << part;
    }
  }
}

// On level ground at the distance r in front of a camera at the height h: a rotation about the horizontal axis across
// the ray raises it by r times the angle.
TEST(CalibrationVariance, GrowsWithTheSquaredDistanceOnLevelGround) {
  const CalibrationErrors rotation{0, 0, 1, 0, 0};
  EXPECT_NEAR(std::sqrt(calibration_variance_m2({{3, 0, -1}, 0.5, {0, 0}}, rotation)), 3 * kRadiansPerDegree, 1e-12);
  EXPECT_EQ(calibration_variance_m2({{3, 0, -1}, 0, {0, 0}}, {1, 0, 0, 0, 0}), 0) << "the baseline is not known";
}

}  // namespace
}  // namespace spartan::internal
