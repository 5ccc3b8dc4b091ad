#include "spartan/testing/synthetic_world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "spartan/numerics/median.h"
#include "spartan/numerics/random.h"

namespace spartan::testing {
namespace {

RectifiedStereo narrow_pair() {
  return {{320, 240}, 246.0, {159.5, 119.5}, 0.12};
}

// A camera `height_m` above the plane z = 0, looking along world x and down.
Pose looking_down(double height_m, double tilt_rad, double x = 0, double y = 0) {
  Eigen::Matrix3d world_from_optical;
  const double s = std::sin(tilt_rad), c = std::cos(tilt_rad);
  world_from_optical.col(0) = Eigen::Vector3d(0, -1, 0);
  world_from_optical.col(1) = Eigen::Vector3d(-s, 0, -c);
  world_from_optical.col(2) = Eigen::Vector3d(c, 0, -s);
  return {world_from_optical, {x, y, height_m}};
}

double sample(const Image<std::uint8_t>& image, double x, int y) {
  const int left = std::min(static_cast<int>(x), image.width() - 2);
  return image(left, y) + (x - left) * (image(left + 1, y) - image(left, y));
}

// Median |left − right warped onto it| with the truth shifted by `error_px`.
double warp_difference(const SyntheticFrame& frame, double error_px) {
  std::vector<double> differences;
  for (int v = 0; v < frame.left.height(); ++v) {
    for (int u = 0; u < frame.left.width(); ++u) {
      if (frame.mask(u, v) != 255) continue;
      const double u_right = u - static_cast<double>(frame.disparity(u, v)) - error_px;
      if (u_right < 0 || u_right > frame.right.width() - 1) continue;
      differences.push_back(std::abs(frame.left(u, v) - sample(frame.right, u_right, v)));
    }
  }
  return median(std::move(differences));
}

SyntheticWorldOptions stony() {
  SyntheticWorldOptions options;
  options.stones_per_m2 = 4;
  return options;
}

TEST(SmoothNoise, HasItsDocumentedDeviationBoundsAndDerivatives) {
  Random random(1);
  double square = 0, steepest = 0, most_curved = 0;
  constexpr int kCount = 200000;
  for (int i = 0; i < kCount; ++i) {
    const double x = random.uniform(-500, 500), y = random.uniform(-500, 500);
    const NoiseSample here = gradient_noise(x, y, 5);
    ASSERT_EQ(here.value, gradient_noise_value(x, y, 5));
    square += here.value * here.value;
    steepest = std::max(steepest, std::hypot(here.dx, here.dy));
    if (i % 100 != 0) continue;
    constexpr double kStep = 1e-6;
    const auto value = [](double a, double b) { return gradient_noise_value(a, b, 5); };
    EXPECT_NEAR(here.dx, (value(x + kStep, y) - value(x - kStep, y)) / (2 * kStep), 1e-6);
    const double angle = random.uniform(0, 3.14), dx = std::cos(angle) * 1e-4, dy = std::sin(angle) * 1e-4;
    most_curved =
        std::max(most_curved, std::abs(value(x + dx, y + dy) + value(x - dx, y - dy) - 2 * here.value) / 1e-8);
    EXPECT_NEAR(here.dy, (value(x, y + kStep) - value(x, y - kStep)) / (2 * kStep), 1e-6);
  }
  EXPECT_NEAR(std::sqrt(square / kCount), kNoiseSigma, 0.003);
  EXPECT_LT(steepest, kNoiseMaxSlope);
  EXPECT_LT(most_curved, kNoiseMaxCurvature);
  EXPECT_GT(most_curved, 0.6 * kNoiseMaxCurvature);
  EXPECT_GT(steepest, 0.8 * kNoiseMaxSlope);
}

TEST(SyntheticTerrain, RaysEndAtTheFirstPointOnTheGround) {
  const SyntheticTerrain terrain(stony());
  Random random(2);
  int hits = 0;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d origin(random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(0.3, 1.0));
    const Eigen::Vector3d direction =
        Eigen::Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-0.8, 0.02)).normalized();
    const auto hit = terrain.intersect(origin, direction, 4.0);
    const double end = hit.value_or(4.0);
    for (double t = 0; t < end - 1e-3; t += 1e-3) {
      const Eigen::Vector3d p = origin + t * direction;
      ASSERT_GT(p.z(), terrain.ground(p.x(), p.y()).value) << "the ray passed through the ground at " << t;
    }
    if (!hit) continue;
    ++hits;
    const Eigen::Vector3d p = origin + *hit * direction;
    ASSERT_NEAR(p.z(), terrain.ground(p.x(), p.y()).value, 1e-8);
  }
  EXPECT_GT(hits, 200);
}

TEST(SyntheticTerrain, NoRayOfAClearConeHitsTheGround) {
  const SyntheticTerrain terrain(stony());
  Random random(4);
  double clear_sum = 0;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d origin(random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(0.3, 1.0));
    const auto somewhere = [&](double size) {
      return Eigen::Vector3d(random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size));
    };
    const Eigen::Vector3d axis = (Eigen::Vector3d(0, 0, -0.5) + somewhere(0.8)).normalized();
    const double spread = random.uniform(0.001, 0.1);
    const double clear = terrain.clear_distance(origin, axis, spread);
    clear_sum += clear;
    for (int k = 0; k < 10; ++k) {
      const Eigen::Vector3d ray = (axis + somewhere(0.5 * spread)).normalized();
      if ((ray - axis).norm() > spread) continue;
      const auto hit = terrain.intersect(origin, ray, 100);
      ASSERT_GE(hit.value_or(clear), clear);
    }
  }
  EXPECT_GT(clear_sum / 300, 0.3);
}

TEST(SyntheticWorld, TruthDisparityWarpsRightOntoLeft) {
  for (const auto& options : {SyntheticWorldOptions{}, stony()}) {
    const SyntheticWorld world(options);
    const SyntheticFrame frame = world.render(narrow_pair(), looking_down(0.3, 0.55), 7);
    const double exact = warp_difference(frame, 0);
    // Noise of 1 level in both images: the median |difference| is about 0.67 · √(1 + 2/3) = 0.87.
    EXPECT_LT(exact, 1.4);
    EXPECT_GT(warp_difference(frame, 0.5), 2 * exact);
    EXPECT_GT(warp_difference(frame, -0.5), 2 * exact);
  }
}

TEST(SyntheticWorld, KnownPointsProjectWhereTheyShould) {
  SyntheticWorldOptions options;
  options.noise_levels = 0;
  const SyntheticWorld world(options);
  const RectifiedStereo stereo = narrow_pair();
  const Pose world_from_left = looking_down(world.relief(1.0, -2.0) + 0.6, 0.55, 1.0, -2.0);
  const SyntheticFrame frame = world.render(stereo, world_from_left, 1);
  Random random(3);
  int seen = 0, off = 0;
  for (int i = 0; i < 2000; ++i) {
    const double x = random.uniform(1.5, 2.5), y = random.uniform(-2.5, -1.5);
    const Eigen::Vector3d in_left = world_from_left.inverse() * Eigen::Vector3d(x, y, world.height(x, y));
    const Eigen::Vector3d uvd = stereo.project(in_left);
    const int u = static_cast<int>(std::floor(uvd.x())), v = static_cast<int>(std::floor(uvd.y()));
    if (u < 0 || v < 0 || u + 1 >= stereo.size.width || v + 1 >= stereo.size.height) continue;
    const double fu = uvd.x() - u, fv = uvd.y() - v;
    const auto d = [&](int a, int b) { return static_cast<double>(frame.disparity(a, b)); };
    const double there =
        (1 - fv) * ((1 - fu) * d(u, v) + fu * d(u + 1, v)) + fv * ((1 - fu) * d(u, v + 1) + fu * d(u + 1, v + 1));
    if (there > uvd.z() + 0.5) continue;  // occluded by a hill
    off += std::abs(there - uvd.z()) > 0.2 ? 1 : 0;
    ++seen;
  }
  EXPECT_GT(seen, 500);
  EXPECT_LE(off, seen / 20) << "more than interpolation across the crests of hills explains";
}

TEST(SyntheticWorld, TrueDisparitiesTriangulateToTheGround) {
  const SyntheticWorld world(stony());
  const Pose world_from_left = looking_down(0.4, 0.55);
  const SyntheticFrame frame = world.render(narrow_pair(), world_from_left, 1);
  for (int v = 60; v < 240; v += 7) {
    for (int u = 0; u < 320; u += 7) {
      const Eigen::Vector3d p =
          world_from_left * narrow_pair().triangulate(u, v, static_cast<double>(frame.disparity(u, v)));
      EXPECT_NEAR(p.z(), world.height(p.x(), p.y()), 2e-5);
    }
  }
}

TEST(SyntheticWorld, MaskMarksOcclusionsInTheRightImage) {
  const SyntheticWorld world(stony());
  const RectifiedStereo stereo = narrow_pair();
  const Pose world_from_left = looking_down(0.3, 0.4);
  const SyntheticFrame frame = world.render(stereo, world_from_left, 1);
  const Eigen::Vector3d right_centre = world_from_left * Eigen::Vector3d(stereo.baseline_m, 0, 0);
  int inside = 0, disagreements = 0, hidden = 0;
  for (int v = 0; v < stereo.size.height; v += 3) {
    for (int u = 0; u < stereo.size.width; u += 3) {
      if (std::isnan(frame.disparity(u, v))) {
        EXPECT_EQ(frame.mask(u, v), 0);
        continue;
      }
      const double d = static_cast<double>(frame.disparity(u, v));
      if (u - d < 0) {
        EXPECT_EQ(frame.mask(u, v), 128);
        continue;
      }
      const Eigen::Vector3d point = world_from_left * stereo.triangulate(u, v, d);
      bool free = true;
      for (double part = 0.2; part < 0.995; part += 0.002) {
        const Eigen::Vector3d p = right_centre + part * (point - right_centre);
        free = free && p.z() > world.height(p.x(), p.y());
      }
      ++inside;
      hidden += free ? 0 : 1;
      disagreements += free != (frame.mask(u, v) == 255) ? 1 : 0;
    }
  }
  EXPECT_GT(hidden, 10);
  EXPECT_LT(disagreements, inside / 200);
}

TEST(SyntheticWorld, NoiseSeedChangesTheNoiseOnly) {
  const SyntheticWorld world({});
  const auto first = world.render(narrow_pair(), looking_down(0.3, 0.55), 1);
  const auto same = world.render(narrow_pair(), looking_down(0.3, 0.55), 1);
  const auto other = world.render(narrow_pair(), looking_down(0.3, 0.55), 2);
  double square = 0;
  for (int v = 0; v < 240; ++v) {
    for (int u = 0; u < 320; ++u) {
      ASSERT_EQ(first.left(u, v), same.left(u, v));
      ASSERT_EQ(first.disparity(u, v), other.disparity(u, v));
      square += std::pow(first.left(u, v) - other.left(u, v), 2);
    }
  }
  EXPECT_NEAR(std::sqrt(square / (320 * 240)), std::sqrt(2 * (1 + 1 / 12.0)), 0.1);
}

TEST(SyntheticWorld, TheSkyHasNoTruth) {
  const SyntheticWorld world({});
  const auto frame = world.render(narrow_pair(), looking_down(0.3, 0.0), 1);
  EXPECT_TRUE(std::isnan(frame.disparity(160, 10)));
  EXPECT_EQ(frame.mask(160, 10), 0);
  EXPECT_EQ(frame.mask(300, 230), 255);
}

}  // namespace
}  // namespace spartan::testing
