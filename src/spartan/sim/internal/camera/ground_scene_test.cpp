#include "spartan/sim/internal/camera/ground_scene.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "spartan/numerics/random.h"
#include "spartan/sim/internal/camera/light.h"

namespace spartan::sim::internal {
namespace {

TEST(GroundScene, OverlappingScenesAgree) {
  const ThreadPool workers(2);
  const TerrainShape shape({}, 3);
  const RockField rocks({.coverage = 0.1}, 3);
  const GroundScene a(shape, rocks, {-1, -1, 2, 1}, workers), b(shape, rocks, {0.333, -1.2, 3.1, 1.5}, workers);
  Random random(1);
  for (int i = 0; i < 500; ++i) {
    const double x = random.uniform(0.4, 1.9), y = random.uniform(-0.9, 0.9);
    const auto height = [&](const GroundScene& scene) {
      RayPacket rays;
      for (int k = 0; k < kPacket; ++k) {
        rays.set(k, (Eigen::Vector3d(x, y, 5) - scene.origin()).cast<float>(), -Eigen::Vector3f::UnitZ(),
                 k == 0 ? 20.0F : -1.0F);
      }
      return 5 - static_cast<double>(scene.intersect(rays).distance[0]);
    };
    EXPECT_NEAR(height(a), height(b), 2e-5);
  }
}

// At a low sun the grid of the ground must not show: the power of the shading at the period of its vertices, over that
// of the neighbouring frequencies.
TEST(GroundScene, ItsGridDoesNotShowAtALowSun) {
  const ThreadPool workers(2);
  const TerrainShape shape({}, 8);
  const GroundScene scene(shape, RockField({.coverage = 0, .pebbles_per_m2 = 0}, 8), {0, 0, 2.2, 0.3}, workers);
  const Sun sun({.sun_elevation_deg = 8, .sun_azimuth_deg = 20, .sun_diameter_deg = 0.35});
  constexpr double kStep_m = 0.0005;
  constexpr int kCount = 4000, kLine = 400;  // kLine: index of the frequency 1/kGrid_m
  const auto wave = [](int k, int i) {
    const double phase = 2 * std::numbers::pi * k * i / kCount;
    return std::complex<double>(std::cos(phase), -std::sin(phase));
  };
  constexpr int kSpread = 160, kNear = 24, kFar = 100;  // bins of 0.5/m
  std::vector<double> power(2 * kSpread + 1);           // around kLine
  for (int row = 0; row < 24; ++row) {
    std::vector<double> shade(kCount);
    for (int first = 0; first < kCount; first += kPacket) {
      RayPacket rays, shadows;
      for (int k = 0; k < kPacket; ++k) {
        const Eigen::Vector3d from(0.1 + kStep_m * (first + k), 0.02 + 0.0113 * row, 5);
        rays.set(k, (from - scene.origin()).cast<float>(), -Eigen::Vector3f::UnitZ(), 20);
      }
      const HitPacket hits = scene.intersect(rays);
      for (int t = 0; t < Sun::kPoints; ++t) {
        for (int k = 0; k < kPacket; ++k) {
          const Eigen::Vector3f n(hits.normal_x[k], hits.normal_y[k], hits.normal_z[k]);
          const Eigen::Vector3f place(rays.origin_x[k], rays.origin_y[k], rays.origin_z[k] - hits.distance[k]);
          shadows.set(k, place + 2e-4F * n, sun.direction(t), n.dot(sun.direction(t)) > 0 ? 20 : -1.0F);
        }
        const std::uint32_t dark = scene.occluded(shadows);
        for (int k = 0; k < kPacket; ++k) {
          const Eigen::Vector3f n(hits.normal_x[k], hits.normal_y[k], hits.normal_z[k]);
          if (shadows.max_distance[k] > 0 && (dark >> k & 1U) == 0)
            shade[static_cast<std::size_t>(first + k)] += static_cast<double>(n.dot(sun.direction(t)));
        }
      }
    }
    // Hann window, so that low frequencies do not leak into these.
    for (int i = 0; i < kCount; ++i)
      shade[static_cast<std::size_t>(i)] *= 0.5 - 0.5 * std::cos(2 * std::numbers::pi * i / kCount);
    for (int k = 0; k < static_cast<int>(power.size()); k += 4) {
      std::complex<double> sum = 0;
      for (int i = 0; i < kCount; ++i) sum += shade[static_cast<std::size_t>(i)] * wave(kLine - kSpread + k, i);
      power[static_cast<std::size_t>(k)] += std::norm(sum);
    }
  }
  double line = 0, around = 0;
  int lines = 0, arounds = 0;
  for (int k = 0; k < static_cast<int>(power.size()); k += 4) {
    const int away = std::abs(k - kSpread);
    if (away <= kNear) line += power[static_cast<std::size_t>(k)], ++lines;
    if (away >= kFar) around += power[static_cast<std::size_t>(k)], ++arounds;
  }
  const double ratio = line / lines / (around / arounds);
  fmt::print("shading at 8 degrees: power at the grid's frequency over its surroundings {:.2f}\n", ratio);
  EXPECT_LT(ratio, 3);
}

}  // namespace
}  // namespace spartan::sim::internal
