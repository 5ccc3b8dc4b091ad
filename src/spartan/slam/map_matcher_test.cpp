#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "spartan/slam/internal/map_refinement.h"
#include "spartan/slam/internal/synthetic_stop_test.h"
#include "spartan/slam/map_merger.h"

namespace spartan {

using namespace internal;

namespace {

using testing::covariance_of;
using testing::Ground;
using testing::points_at;
using testing::pose_at;
using testing::pose_on_ground;
using testing::rocky_ground;

struct Scene {
  Pose now;
  std::vector<SurfacePoint> points;
  MapView global;
};

Scene scene(const Ground& mapped, const Ground& seen, const Pose& before, const Pose& now) {
  const ThreadPool workers(2);
  GlobalMap map = GlobalMap::create({}, 0.05).value();
  static_cast<void>(map.add(MapGenerator::create({}, workers)->generate(points_at(mapped, before, 1), before), {},
                            {before, {}}, Matrix6d::Zero()));
  return {now, points_at(seen, now, 2),
          *map.view(window_around(now.translation().x(), now.translation().y(), 5, 0.05))};
}

Scene scene(const Ground& ground) {
  return scene(ground, ground, pose_on_ground(ground, 0, 0, 0), pose_on_ground(ground, 1, 0.2, 0.1));
}

Vector6d offset(double dx, double dy, double dz, double roll, double pitch, double yaw) {
  Vector6d v;
  v << dx, dy, dz, roll, pitch, yaw;
  return v;
}

MapMatch match(const Scene& s, const Vector6d& off, int threads = 2) {
  const ThreadPool workers(threads);
  const UncertainPose prior{moved(s.now, s.now.translation(), off), covariance_of(0.08, 0.02)};
  return match_map(s.points, MapGenerator::create({}, workers)->generate(s.points, prior.pose), s.global, prior, 2, {},
                   workers);
}

double distance(const Pose& a, const Pose& b) {
  return (a.inverse() * b).translation().norm();
}

TEST(MapMatcher, AcceptsAMatchOnRockyGround) {
  const Scene s = scene(rocky_ground());
  const MapMatch m = match(s, offset(0.15, -0.1, 0.05, 0.02, -0.01, 0.04));
  EXPECT_EQ(name_of(m.status), "decided");
  EXPECT_LT(distance(s.now, m.world_from_body), 0.003);
  EXPECT_LT(rotation_angle(s.now.inverse() * m.world_from_body), 0.002);
  EXPECT_EQ(m.determined, 6);
  EXPECT_GT(m.overlap, 0.3);
  EXPECT_LT(m.sigma_m, 0.01);
  const Vector6d error = log_se3(m.world_from_body.inverse() * s.now);
  EXPECT_LT(error.dot(m.information * error), 22.5) << "within its own uncertainty";
}

TEST(MapMatcher, OverlapOfTheSameGroundIsAboutOne) {
  const Ground ground = rocky_ground();
  const Pose pose = pose_on_ground(ground, 0, 0, 0);
  const MapMatch m = match(scene(ground, ground, pose, pose), offset(0.05, 0, 0, 0, 0, 0));
  EXPECT_GT(m.overlap, 0.9);
  EXPECT_LE(m.overlap, 1);
}

TEST(MapMatcher, IsDeterministicForAnyNumberOfThreads) {
  const Scene s = scene(rocky_ground());
  const Vector6d off = offset(0.1, 0.1, 0, 0, 0, 0.03);
  const MapMatch one = match(s, off, 1), two = match(s, off, 2);
  EXPECT_EQ(one.world_from_body.matrix(), two.world_from_body.matrix());
  EXPECT_EQ(one.information, two.information);
  EXPECT_EQ(one.margin, two.margin);
}

TEST(MapMatcher, RejectsAMatchOnAPlane) {
  const Ground plane = [](double x, double y) { return 0.05 * x + 0.02 * y; };
  for (const double dx : {0.0, 0.15}) {
    const MapMatch m = match(scene(plane), offset(dx, 0.1, 0.05, 0.01, 0.01, 0.03));
    EXPECT_FALSE(m.decided());
    // Height and tilt may be determined, the position on the plane is not.
    const Matrix6d r = m.information;
    EXPECT_LT(r(0, 0) + r(1, 1), 1e-2 * std::max(r(2, 2), 1.0) + 3e4);
  }
}

TEST(MapMatcher, OneDirectionIsUndeterminedOnDunes) {
  const Ground dunes = [](double x, double) { return 0.06 * std::sin(2.1 * x) + 0.03 * std::sin(5.3 * x + 1); };
  const MapMatch m = match(scene(dunes), offset(0.1, 0.1, 0.02, 0, 0, 0.02));
  EXPECT_EQ(name_of(m.status), "flat");
  EXPECT_EQ(m.determined, 5);
  const Eigen::SelfAdjointEigenSolver<Matrix6d> axes(m.information);
  EXPECT_LT(axes.eigenvalues()[0], 1e-6 * axes.eigenvalues()[5]);
  // The undetermined direction is along the crests, the world's y axis.
  const Eigen::Vector3d undetermined = m.world_from_body.rotation() * axes.eigenvectors().col(0).head<3>();
  EXPECT_GT(std::abs(undetermined.y()), 0.9);
}

TEST(MapMatcher, PeriodicGroundIsAmbiguous) {
  const Ground egg_box = [](double x, double y) { return 0.02 * std::sin(21 * x) * std::sin(21 * y); };
  const MapMatch m = match(scene(egg_box), offset(0.1, -0.05, 0.02, 0, 0, 0.01));
  EXPECT_EQ(name_of(m.status), "ambiguous");
  EXPECT_TRUE(m.information.isZero());
}

TEST(MapMatcher, RejectsDifferentGround) {
  for (const std::uint64_t seed : {11U, 12U}) {
    const Ground here = rocky_ground(3), there = rocky_ground(seed);
    const MapMatch m = match(scene(there, here, pose_on_ground(there, 0, 0, 0), pose_on_ground(here, 1, 0.2, 0.1)),
                             offset(0.1, 0, 0, 0, 0, 0.02));
    EXPECT_FALSE(m.decided()) << seed;
  }
}

TEST(MapMatcher, ReportsTooLittleOverlap) {
  const Ground ground = rocky_ground();
  const MapMatch m = match(scene(ground, ground, pose_on_ground(ground, 0, 0, 0), pose_on_ground(ground, 4.2, 0, 0)),
                           offset(0, 0, 0, 0, 0, 0));
  EXPECT_EQ(name_of(m.status), "no_overlap");
  EXPECT_TRUE(m.information.isZero());
}

TEST(MapMatcher, RejectsAnOffsetOutsideOfTheSearchWindow) {
  const Scene s = scene(rocky_ground());
  EXPECT_FALSE(match(s, offset(0.45, 0, 0, 0, 0, 0)).decided());  // the window ends at 3 · 8 cm
}

// A rigid motion of the whole world, map and rover, moves the result alike.
TEST(MapMatcher, IsEquivariantToMotionsOfTheWorld) {
  const Ground ground = rocky_ground();
  const Scene here = scene(ground);
  const Vector6d off = offset(0.1, -0.08, 0.03, 0.01, 0, 0.02);
  const MapMatch a = match(here, off);
  ASSERT_TRUE(a.decided());
  Random random(4);
  for (int i = 0; i < 2; ++i) {
    const Pose world = pose_at(random.uniform(-10, 10), random.uniform(-10, 10), 0.3, random.uniform(-3, 3));
    const Ground elsewhere = [&](double u, double v) {
      const Eigen::Vector3d p = world.inverse() * Eigen::Vector3d(u, v, 0);
      return ground(p.x(), p.y()) + 0.3;
    };
    const Scene there = scene(elsewhere, elsewhere, world * pose_on_ground(ground, 0, 0, 0), world * here.now);
    const MapMatch b = match(there, off);
    ASSERT_TRUE(b.decided());
    const Pose apart = (world * a.world_from_body).inverse() * b.world_from_body;
    EXPECT_LT(apart.translation().norm(), 0.003);
    EXPECT_LT(rotation_angle(apart), 0.002);
  }
}

// Four cells that are too far from all others for the ground surface to be fitted there.
std::vector<SurfacePoint> with_island(std::vector<SurfacePoint> points, const Eigen::Vector3d& in_body) {
  const Eigen::Vector3f along = (in_body - Eigen::Vector3d(0, 0, 1)).normalized().cast<float>();
  for (const float x : {0.0F, 0.05F}) {
    for (const float y : {0.0F, 0.05F})
      points.push_back({in_body.cast<float>() + Eigen::Vector3f(x, y, 0), 0.005F, along, GroundClass::ground});
  }
  return points;
}

TEST(MapMatcher, AnIslandWithoutGroundDoesNotSpoilTheMatch) {
  const Ground ground = rocky_ground();
  const ThreadPool workers(2);
  const Pose before = pose_on_ground(ground, 0, 0, 0), now = pose_on_ground(ground, 1, 0.2, 0.1);
  const Eigen::Vector3d island(-2.02, -2.02, 0.1);
  GlobalMap map = GlobalMap::create({}, 0.05).value();
  const LocalMap mapped =
      MapGenerator::create({}, workers)->generate(with_island(points_at(ground, before, 1), island), before);
  ASSERT_TRUE(map.add(mapped, {}, {before, {}}, Matrix6d::Zero()));
  const Eigen::Vector3d in_world = before * island;
  const MapView view = *map.view(window_around(now.translation().x(), now.translation().y(), 5, 0.05));
  const GridCell cell = cell_at(view.place(), in_world.x(), in_world.y());
  EXPECT_GT(view.count(cell.column, cell.row), 0);
  EXPECT_EQ(view.occupancy_logodds(cell.column, cell.row), 0);
  EXPECT_EQ(view.kind(cell.column, cell.row), GroundClass::unknown) << "no class was observed";
  const Scene s{now, with_island(points_at(ground, now, 2), now.inverse() * in_world), *map.view(view.window)};
  EXPECT_EQ(name_of(match(s, offset(0.15, -0.1, 0.05, 0.02, -0.01, 0.04)).status), "decided");
}

}  // namespace
}  // namespace spartan
