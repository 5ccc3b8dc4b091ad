#include "spartan/sim/internal/camera/rover_body.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "spartan/testing/real_data.h"

namespace spartan::sim::internal {
namespace {

Rig shipped() {
  return read_rig_yaml(testing::source_folder() + "/config/rigs/rover_square.yaml").value();
}

std::vector<MountedCamera> mounted(const Rig& rig, double pan_rad, double tilt_rad) {
  std::vector<MountedCamera> cameras;
  cameras.reserve(rig.cameras.size());
  for (const Camera& camera : rig.cameras)
    cameras.push_back({rig.body_from_camera(camera.name, pan_rad, tilt_rad), camera.mount != "body"});
  return cameras;
}

RoverBody body_of(const Rig& rig, double pan_rad = 0) {
  return RoverBody(make_rover_mesh({}, rig.pan_tilt_units, mounted(rig, pan_rad, rig.pan_tilt_units[0].rest_tilt_rad)));
}

// Eight rays in the body frame of a rover at a pose, against ground that is infinitely far.
struct Traced {
  std::array<float, kPacket> albedo{};
  HitPacket hits{};
};
Traced trace(const RoverBody& body, const Pose& world_from_body, const Eigen::Vector3d& from,
             const Eigen::Vector3d& towards) {
  RayPacket rays;
  for (int k = 0; k < kPacket; ++k) {
    rays.set(k, (world_from_body * from).cast<float>(),
             (world_from_body.rotation() * towards.normalized()).cast<float>(), 100);
  }
  Traced traced;
  std::fill_n(traced.hits.distance, kPacket, std::numeric_limits<float>::infinity());
  const Pose body_from_world = world_from_body.inverse();
  RoverBody::Poses poses;
  poses.fill(&body_from_world);
  traced.albedo = body.intersect(rays, poses, traced.hits);
  return traced;
}

TEST(RoverBody, WheelsAreWhereTheChassisHasThem) {
  const RoverBody body = body_of(shipped());
  const Pose somewhere(Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Eigen::Vector3d(0.1, 0.2, 1).normalized())),
                       {4, -3, 0.5});
  for (const double x : {0.35, -0.35}) {
    for (const double y : {0.3, -0.3}) {
      const Traced wheel = trace(body, somewhere, {x, 2 * y, 0.1}, {0, -y, 0});
      EXPECT_NEAR(wheel.hits.distance[0], 0.3 - 0.04, 1e-3) << "the outer side of the wheel";
      EXPECT_GT(wheel.albedo[0], 0);
      const double end = x + std::copysign(0.1, x);
      EXPECT_GT(trace(body, somewhere, {end - std::copysign(0.005, x), 2 * y, 0.1}, {0, -y, 0}).albedo[0], 0);
      EXPECT_EQ(trace(body, somewhere, {end + std::copysign(0.005, x), 2 * y, 0.1}, {0, -y, 0}).albedo[0], 0);
      const Eigen::Vector3d normal(wheel.hits.normal_x[0], wheel.hits.normal_y[0], wheel.hits.normal_z[0]);
      EXPECT_LT((somewhere.rotation().conjugate() * normal - Eigen::Vector3d(0, y > 0 ? 1 : -1, 0)).norm(), 1e-4);
    }
  }
  EXPECT_EQ(trace(body, somewhere, {1, 1, 1}, {1, 0, 0}).albedo[0], 0) << "past the rover";
}

TEST(RoverBody, NoCameraIsInsideAndEveryOneSeesPastIt) {
  const Rig rig = shipped();
  for (const double pan_rad : {-0.6, 0.0, 0.6}) {
    const RoverBody body = body_of(rig, pan_rad);
    for (const MountedCamera& camera : mounted(rig, pan_rad, rig.pan_tilt_units[0].rest_tilt_rad)) {
      const Eigen::Vector3d axis = camera.body_from_camera.rotation() * Eigen::Vector3d::UnitZ();
      EXPECT_EQ(trace(body, {}, camera.body_from_camera.translation(), axis).albedo[0], 0);
      EXPECT_NEAR(trace(body, {}, camera.body_from_camera.translation(), -axis).hits.distance[0], 0.015, 1e-3)
          << "the housing behind it";
    }
  }
}

TEST(RoverBody, TheNarrowPairSeesTheFrontWheels) {
  const Rig rig = shipped();
  const RoverBody body = body_of(rig);
  for (const auto& [camera, side] : {std::pair{"narrow_left", 1}, std::pair{"narrow_right", -1}}) {
    int seen = 0;
    for (int y = 0; y < 480; y += 8) {
      for (int x = 0; x < 640; x += 8) {
        const auto ray = unproject(rig.find_camera(camera)->model, Eigen::Vector2d(x, y));
        const Pose pose = rig.body_from_camera(camera);
        if (trace(body, {}, pose.translation(), pose.rotation() * ray->direction).albedo[0] == 0) continue;
        ++seen;
        EXPECT_GT(std::abs(x - 320), 160) << "only at the sides, row " << y;
      }
    }
    EXPECT_GT(seen, 4) << camera << side;
    EXPECT_LT(seen, 60 * 80 / 5) << camera;
  }
}

TEST(RoverBody, CastsItsShadow) {
  const RoverBody body = body_of(shipped());
  RayPacket rays;
  for (int k = 0; k < kPacket; ++k) rays.set(k, {-0.2F + 0.5F * static_cast<float>(k), 0, 0.01F}, {0, 0, 1}, 400);
  const Pose at_origin;
  RoverBody::Poses poses;
  poses.fill(&at_origin);
  EXPECT_EQ(body.occluded(rays, poses), 1U) << "below the deck, and before the rover";
}

}  // namespace
}  // namespace spartan::sim::internal
