// Simulated observations of known ground: points with noise, for the tests of this module.
#pragma once

#include <cmath>
#include <functional>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/numerics/random.h"
#include "spartan/reconstruction/map_generator.h"
#include "spartan/testing/synthetic_terrain.h"

namespace spartan::testing {

using Ground = std::function<double(double x, double y)>;

/// Hills of a few centimetres and stones.
inline Ground rocky_ground(std::uint64_t seed = 3) {
  SyntheticWorldOptions options;
  options.seed = seed;
  options.relief_m = 0.03;
  options.relief_size_m = 2;
  options.stones_per_m2 = 3;
  options.stone_size_m = 0.25;
  return [terrain = SyntheticTerrain(options)](double x, double y) { return terrain.ground(x, y).value; };
}

/// Points in a sector of 120 degrees from 0.6 to 4 m ahead of the body, whose origin is on the ground, with the camera
/// 1 m above. There are no occlusions. The noise along a ray is that of a disparity, independent from point to point.
inline std::vector<SurfacePoint> points_at(const Ground& ground, const Pose& world_from_body, std::uint64_t seed,
                                           double noise = 1) {
  std::vector<SurfacePoint> points;
  const Pose body_from_world = world_from_body.inverse();
  const Eigen::Vector3d camera = world_from_body * Eigen::Vector3d(0, 0, 1);
  const Eigen::Vector3d ahead = world_from_body.rotation() * Eigen::Vector3d::UnitX();
  const double heading = std::atan2(ahead.y(), ahead.x());
  Random random(seed);
  constexpr double kStep = 0.018;
  for (double range = 0.6; range < 4; range += kStep) {
    for (double turn = -1.05; turn < 1.05; turn += kStep / range) {
      const double x = camera.x() + range * std::cos(heading + turn), y = camera.y() + range * std::sin(heading + turn);
      const Eigen::Vector3d place(x, y, ground(x, y)), ray = (place - camera).normalized();
      const double sigma = 0.001 + 0.0012 * range * range;
      const Eigen::Vector3d seen = place + noise * sigma * 0.3 * random.normal() * ray;
      points.push_back({(body_from_world * seen).cast<float>(), static_cast<float>(sigma),
                        (body_from_world.rotation() * ray).cast<float>(), GroundClass::ground});
    }
  }
  return points;
}

inline Pose pose_at(double x, double y, double z, double yaw) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())), Eigen::Vector3d(x, y, z)};
}

/// A pose on the ground.
inline Pose pose_on_ground(const Ground& ground, double x, double y, double yaw) {
  return pose_at(x, y, ground(x, y), yaw);
}

inline Matrix6d covariance_of(double sigma_m, double sigma_rad) {
  Matrix6d m = Matrix6d::Zero();
  m.diagonal() << Eigen::Vector3d::Constant(sigma_m * sigma_m), Eigen::Vector3d::Constant(sigma_rad * sigma_rad);
  return m;
}

}  // namespace spartan::testing
