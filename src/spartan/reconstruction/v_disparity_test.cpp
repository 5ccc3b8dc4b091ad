#include "spartan/reconstruction/v_disparity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "spartan/core/pose.h"
#include "spartan/numerics/random.h"
#include "spartan/rig/rig.h"
#include "spartan/testing/height_field_view.h"

namespace spartan {
namespace {

const RectifiedStereo kGroundView{{373, 373}, 400, {186, 186}, 0.2};

struct Scene {
  Image<float> disparity;
  Image<std::uint8_t> truth;  // classes by the true height above the ground
  GroundPlane expected;
  Eigen::Vector3d up = Eigen::Vector3d::Zero();  // true direction, in the optical frame
};

using Height = std::function<double(double, double)>;

// The view of a rover that may be rolled; `surface` is `ground` with rocks and pits.
Scene look_at(const Height& ground, const Height& surface, double roll_deg = 0, double noise_px = 0.15) {
  const Pose world_from_body = Pose::from_rotation(
      Eigen::Quaterniond(Eigen::AngleAxisd(roll_deg * kRadiansPerDegree, Eigen::Vector3d::UnitX())));
  const Pose world_from_left =
      world_from_body * testing::camera_pose_at(1, 0, 39 * kRadiansPerDegree, optical_from_forward());
  Scene seen{testing::disparity_of(surface, kGroundView, world_from_left),
             Image<std::uint8_t>(373, 373),
             {},
             world_from_left.rotation().conjugate() * Eigen::Vector3d::UnitZ()};
  // The prediction of the rig, without the roll.
  seen.expected = {
      testing::camera_pose_at(1, 0, 39 * kRadiansPerDegree, optical_from_forward()).rotation().conjugate() *
          Eigen::Vector3d::UnitZ(),
      1};
  Random random(1, 5);
  for (int y = 0; y < 373; ++y) {
    for (int x = 0; x < 373; ++x) {
      const double d = seen.disparity(x, y);
      if (!(d > 0)) continue;
      const Eigen::Vector3d p = world_from_left * kGroundView.triangulate(x, y, d);
      const double over = p.z() - ground(p.x(), p.y());
      seen.truth(x, y) = over > 0.12 ? 2 : over < -0.12 ? 3 : std::abs(over) < 0.04 ? 1 : 0;  // 0: not scored
      seen.disparity(x, y) = static_cast<float>(d + random.normal(0, noise_px));
    }
  }
  return seen;
}

struct Recall {
  int correct = 0, all = 0;
  double of() const { return static_cast<double>(correct) / std::max(all, 1); }
};

// Recall: the fraction of the pixels of a class that are classified correctly.
Recall recall(const Scene& seen, const VDisparity& found, std::uint8_t kind) {
  Recall recall;
  for (int y = 0; y < 373; ++y) {
    for (int x = 0; x < 373; ++x) {
      if (seen.truth(x, y) != kind) continue;
      ++recall.all;
      recall.correct += found.classes(x, y) == kind ? 1 : 0;
    }
  }
  return recall;
}

const Height kFlat = [](double, double) { return 0.0; };

TEST(VDisparity, LevelGroundGivesCameraHeightAndPitch) {
  const Scene seen = look_at(kFlat, kFlat);
  const auto found = compute_v_disparity(seen.disparity, kGroundView, seen.expected, {}, ThreadPool(2));
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->plane.height_m, 1, 0.005);
  EXPECT_NEAR(found->plane.pitch_rad(), 39 * kRadiansPerDegree, 0.2 * kRadiansPerDegree);
  EXPECT_GT(recall(seen, *found, 1).of(), 0.999);
}

TEST(VDisparity, RocksAreObstaclesAndPitsAreCavities) {
  const Height surface = [](double x, double y) {
    if (std::hypot(x - 1.4, y - 0.3) < 0.15) return 0.25;
    if (std::hypot(x - 2.2, y + 0.4) < 0.3) return -0.3;
    return 0.0;
  };
  for (const double roll_deg : {0.0, 12.0, -12.0}) {
    const Scene seen = look_at(kFlat, surface, roll_deg);
    const auto found = compute_v_disparity(seen.disparity, kGroundView, seen.expected, {}, ThreadPool(2));
    ASSERT_TRUE(found) << roll_deg;
    ASSERT_GT(recall(seen, *found, 2).all, 500);
    ASSERT_GT(recall(seen, *found, 3).all, 300);
    EXPECT_GT(recall(seen, *found, 1).of(), 0.995) << roll_deg;
    EXPECT_GT(recall(seen, *found, 2).of(), 0.97) << roll_deg;
    EXPECT_GT(recall(seen, *found, 3).of(), 0.9) << roll_deg;
    EXPECT_LT(std::acos(std::min(1.0, found->plane.up.dot(seen.up))), 0.3 * kRadiansPerDegree);
  }
}

// A rock of 25 cm is an obstacle where the disparities are that certain, not where their noise may be as large.
TEST(VDisparity, TheSigmaOfAPixelWidensItsThreshold) {
  const Height surface = [](double x, double y) { return std::hypot(x - 1.4, y - 0.3) < 0.15 ? 0.25 : 0.0; };
  const Scene seen = look_at(kFlat, surface);
  const auto obstacles = [&](float sigma_px) {
    const Image<float> sigma(373, 373, sigma_px);
    const auto found = compute_v_disparity(seen.disparity, kGroundView, seen.expected, {}, ThreadPool(1), sigma);
    EXPECT_TRUE(found);
    return recall(seen, *found, 2).of();
  };
  EXPECT_GT(obstacles(0.15F), 0.97);
  EXPECT_LT(obstacles(15), 0.01);
}

// A dip, then a rise of 15 degrees: both are ground, and a rock on them is an obstacle.
TEST(VDisparity, TheProfileFollowsUnevenGround) {
  const Height hills = [](double x, double) { return 0.08 * std::sin(2.2 * x) + 0.27 * std::max(0.0, x - 2.2); };
  const Height with_rock = [&](double x, double y) {
    return hills(x, y) + (std::hypot(x - 2.6, y) < 0.15 ? 0.25 : 0.0);
  };
  const Scene seen = look_at(hills, with_rock);
  const auto found = compute_v_disparity(seen.disparity, kGroundView, seen.expected, {}, ThreadPool(2));
  ASSERT_TRUE(found);
  EXPECT_GT(recall(seen, *found, 1).of(), 0.98);
  EXPECT_GT(recall(seen, *found, 2).of(), 0.9);
}

// Ground that is higher on the left: several strips follow it, one profile does not.
TEST(VDisparity, StripsFollowGroundThatIsHigherOnOneSide) {
  const Height bank = [](double x, double y) {
    return y > 0.2 ? 0.25 * std::min(1.0, (y - 0.2) * 1.2) * std::min(1.0, x) : 0.0;
  };
  const Scene seen = look_at(bank, bank);
  VDisparityOptions one, many;
  one.strips = 1;
  many.strips = 9;
  const auto narrow = compute_v_disparity(seen.disparity, kGroundView, seen.expected, many, ThreadPool(2));
  const auto wide = compute_v_disparity(seen.disparity, kGroundView, seen.expected, one, ThreadPool(2));
  ASSERT_TRUE(narrow && wide);
  EXPECT_LT(1 - recall(seen, *narrow, 1).of(), 0.2 * (1 - recall(seen, *wide, 1).of()));
}

TEST(VDisparity, TheHistogramContainsEveryKnownPixelOnce) {
  const Scene seen = look_at(kFlat, kFlat, 8);
  const auto found = compute_v_disparity(seen.disparity, kGroundView, seen.expected, {}, ThreadPool(1));
  ASSERT_TRUE(found);
  int in_histogram = 0, known = 0, widest = 0;
  for (int y = 0; y < found->histogram.height(); ++y) {
    int first = -1, last = -1;
    for (int x = 0; x < found->histogram.width(); ++x) {
      in_histogram += found->histogram(x, y);
      if (found->histogram(x, y) > 3) {
        first = first < 0 ? x : first;
        last = x;
      }
    }
    widest = std::max(widest, last - first);
  }
  for (int y = 0; y < 373; ++y) {
    for (int x = 0; x < 373; ++x) known += seen.disparity(x, y) > 0 ? 1 : 0;
  }
  EXPECT_EQ(in_histogram, known);
  EXPECT_LT(widest, 4) << "after derotation the ground is a thin line";
}

TEST(VDisparity, IsDeterministicForAnyNumberOfThreads) {
  const Scene seen = look_at(kFlat, [](double x, double y) { return std::hypot(x - 1.4, y) < 0.2 ? 0.2 : 0.0; });
  const auto a = compute_v_disparity(seen.disparity, kGroundView, seen.expected, {}, ThreadPool(1)),
             b = compute_v_disparity(seen.disparity, kGroundView, seen.expected, {}, ThreadPool(2));
  ASSERT_TRUE(a && b);
  for (std::size_t i = 0; i < a->profiles.size(); ++i) EXPECT_EQ(a->profiles[i].height_m, b->profiles[i].height_m);
  for (int y = 0; y < 373; ++y) {
    for (int x = 0; x < 373; ++x) ASSERT_EQ(a->classes(x, y), b->classes(x, y));
  }
}

}  // namespace
}  // namespace spartan
