#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

#include "spartan/core/pose.h"
#include "spartan/numerics/random.h"
#include "spartan/reconstruction/v_disparity.h"
#include "spartan/rig/rig.h"

namespace spartan {
namespace {

const RectifiedStereo kView{{400, 400}, 430, {199.5, 199.5}, 0.2};

// A plane seen by a camera that is pitched down and rolled.
GroundPlane plane_seen(double height_m, double pitch_deg, double roll_deg) {
  const double p = pitch_deg * kRadiansPerDegree, r = roll_deg * kRadiansPerDegree;
  // Up in the optical frame of a camera without roll: (0, −cos p, −sin p).
  return {{std::cos(p) * std::sin(r), -std::cos(p) * std::cos(r), -std::sin(p)}, height_m};
}

struct Noise {
  double sigma_px = 0.2, holes = 0.05, rocks = 0;
};

Image<float> disparity_of(const GroundPlane& plane, const Noise& noise, std::uint64_t seed) {
  Random random(seed, 1);
  Image<float> image(kView.size.width, kView.size.height, std::numeric_limits<float>::quiet_NaN());
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const double d = plane.disparity(kView, x, y);
      if (d > 1 && random.uniform() > noise.holes)
        image(x, y) = static_cast<float>(d + random.normal(0, noise.sigma_px));
    }
  }
  // Rocks: upright discs with the disparity of the ground at their lower end.
  const int count = static_cast<int>(noise.rocks * 400 * 400 / 2500);
  for (int i = 0; i < count; ++i) {
    const int cx = static_cast<int>(random.below(400)), cy = static_cast<int>(random.below(400));
    const double d = plane.disparity(kView, cx, cy + 28);
    for (int y = std::max(cy - 28, 0); y < std::min(cy + 28, 400); ++y) {
      for (int x = std::max(cx - 28, 0); x < std::min(cx + 28, 400); ++x) {
        if (std::hypot(x - cx, y - cy) < 28 && d > 1)
          image(x, y) = static_cast<float>(d + random.normal(0, noise.sigma_px));
      }
    }
  }
  return image;
}

// d is linear in the image: f b / z of the point where the ray intersects the plane.
TEST(GroundPlane, DisparityTriangulatesToAPointOnThePlane) {
  const GroundPlane plane = plane_seen(1.1, 35, 7);
  for (const double u : {0.0, 150.0, 399.0}) {
    for (const double v : {120.0, 250.0, 399.0}) {
      const Eigen::Vector3d p = kView.triangulate(u, v, plane.disparity(kView, u, v));
      EXPECT_NEAR(plane.up.dot(p), -1.1, 1e-9);
    }
  }
  EXPECT_NEAR(plane.pitch_rad(), 35 * kRadiansPerDegree, 1e-9);
  EXPECT_NEAR(plane.roll_rad(), 7 * kRadiansPerDegree, 1e-9);
}

TEST(GroundPlane, PitchAndRollAreThoseOfTheMountedCamera) {
  const Pose body_from_left =
      Pose::from_rotation(Eigen::Quaterniond(Eigen::AngleAxisd(39 * kRadiansPerDegree, Eigen::Vector3d::UnitY()))) *
      optical_from_forward().inverse();
  const GroundPlane plane{body_from_left.rotation().conjugate() * Eigen::Vector3d::UnitZ(), 1};
  EXPECT_NEAR(plane.pitch_rad(), 39 * kRadiansPerDegree, 1e-9);
  EXPECT_NEAR(plane.roll_rad(), 0, 1e-9);
}

RC_GTEST_PROP(GroundPlane, IsEstimatedWithNoiseHolesAndRocks, ()) {
  const double height = 0.01 * *rc::gen::inRange(30, 200), pitch = *rc::gen::inRange(15, 50),
               roll = *rc::gen::inRange(-20, 20);
  const GroundPlane truth = plane_seen(height, pitch, roll);
  const auto found = find_ground_plane(disparity_of(truth, {0.2, 0.05, 0.25}, *rc::gen::arbitrary<std::uint32_t>()),
                                       kView, plane_seen(0.9 * height, pitch + 4, roll + 5), {});
  RC_ASSERT(found.has_value());
  RC_ASSERT(std::abs(found->height_m / height - 1) < 0.01);
  RC_ASSERT(std::acos(std::min(1.0, found->up.dot(truth.up))) < 0.3 * kRadiansPerDegree);
}

TEST(GroundPlane, IsExactWithoutNoise) {
  const GroundPlane truth = plane_seen(1, 39, 3);
  const auto found = find_ground_plane(disparity_of(truth, {0, 0, 0}, 1), kView, plane_seen(0.8, 35, 0), {});
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->height_m, 1, 1e-4);
  EXPECT_LT((found->up - truth.up).norm(), 1e-4);
}

TEST(GroundPlane, IsNotFoundWhereThereIsNoGround) {
  const GroundPlane expected = plane_seen(1, 39, 0);
  const Image<float> nothing(400, 400, std::numeric_limits<float>::quiet_NaN()), wall(400, 400, 60.0F);
  EXPECT_FALSE(find_ground_plane(nothing, kView, expected, {}));
  EXPECT_FALSE(find_ground_plane(wall, kView, expected, {}));
  Random random(2, 1);
  Image<float> noise_only(400, 400);
  for (int y = 0; y < 400; ++y) {
    for (int x = 0; x < 400; ++x) noise_only(x, y) = static_cast<float>(random.uniform(5, 200));
  }
  EXPECT_FALSE(find_ground_plane(noise_only, kView, expected, {}));
}

}  // namespace
}  // namespace spartan
