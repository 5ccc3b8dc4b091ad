#include "spartan/slam/map_merger.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>

#include "spartan/slam/internal/map_refinement.h"
#include "spartan/slam/internal/synthetic_stop_test.h"
#include "spartan/testing/temporary_folder.h"
#include "spartan/testing/text_checks.h"

namespace spartan {

using namespace internal;

namespace {

using testing::covariance_of;
using testing::Ground;
using ::testing::HasSubstr;
using testing::points_at;
using testing::pose_on_ground;
using testing::rocky_ground;
using testing::TemporaryFolder;

Pose off_by(const Pose& pose, double x, double y, double yaw) {
  Vector6d eta;
  eta << x, y, 0.02, 0.01, -0.005, yaw;
  return moved(pose, pose.translation(), eta);
}

MapMerger make_merger() {
  return MapMerger::create({}, {}, ThreadPool(2)).value();
}

Pose stop(const Ground& ground, int i) {
  return pose_on_ground(ground, 1.0 * i, 0.2 * i, 0.1 * i);
}

// The i-th stop of a drive, with a prior that is wrong by 10 cm and more than a degree.
Result<MapMergeResult> visit(MapMerger& to, const Ground& ground, int i) {
  const Pose at = stop(ground, i);
  const UncertainPose prior = i == 0 ? UncertainPose{at, Matrix6d::Zero()}
                                     : UncertainPose{off_by(at, 0.08, -0.06, 0.02), covariance_of(0.08, 0.02)};
  return to.add(points_at(ground, at, static_cast<std::uint64_t>(i) + 1), {100 + i}, prior);
}

TEST(MapMerger, TheFirstStopKeepsItsPriorPose) {
  const Ground ground = rocky_ground();
  MapMerger merger = make_merger();
  const auto first = visit(merger, ground, 0);
  ASSERT_TRUE(first);
  EXPECT_FALSE(first->decided());
  EXPECT_FALSE(first->constraint);
  EXPECT_EQ(first->corrected.pose.matrix(), stop(ground, 0).matrix());
  EXPECT_EQ(merger.map().stops().size(), 1U);
}

TEST(MapMerger, TheSecondStopIsCorrectedAndGivesAConstraint) {
  const Ground ground = rocky_ground();
  MapMerger merger = make_merger();
  ASSERT_TRUE(visit(merger, ground, 0));
  const auto second = visit(merger, ground, 1);
  ASSERT_TRUE(second);
  EXPECT_TRUE(second->decided());
  const Pose wrong = stop(ground, 1).inverse() * second->corrected.pose;
  EXPECT_LT(wrong.translation().norm(), 0.003);
  EXPECT_LT(rotation_angle(wrong), 0.002);
  ASSERT_TRUE(second->constraint);
  EXPECT_EQ(second->constraint->stamp.ns, 101);
  EXPECT_EQ(second->constraint->information, second->constraint->information.transpose());
  EXPECT_TRUE(second->constraint->map_covariance.isZero()) << "the first stop has no covariance";
  EXPECT_EQ(merger.map().stops()[1].world_from_body.pose.matrix(), second->corrected.pose.matrix());
}

TEST(MapMerger, TheCovarianceOfTheMapIsNotReduced) {
  const Ground ground = rocky_ground();
  MapMerger merger = make_merger();
  Matrix6d covariance = covariance_of(0.05, 0.01);
  covariance(0, 5) = covariance(5, 0) = 2e-4;
  const Pose a = stop(ground, 0), b = stop(ground, 1);
  ASSERT_TRUE(merger.add(points_at(ground, a, 1), {}, {a, covariance}));
  const Matrix6d transport = adjoint(b.inverse() * a), of_map = transport * covariance * transport.transpose();
  const Matrix6d driven = covariance_of(0.08, 0.02);
  const auto second = merger.add(points_at(ground, b, 2), {}, {b, of_map + driven});
  ASSERT_TRUE(second && second->constraint);
  EXPECT_LT((second->constraint->map_covariance - of_map).norm(), 0.01 * of_map.norm())
      << "transported rigidly from its stop";
  // Odometry and match are two independent measurements of the motion since the first stop.
  const Matrix6d since = (driven.inverse() + second->match.information).inverse();
  EXPECT_LT((second->corrected.covariance - of_map - since).norm(), 0.02 * of_map.norm());
  EXPECT_LT((second->corrected.covariance - of_map - since).diagonal().norm(), 0.5 * since.norm());
}

TEST(MapMerger, KeepsThePriorPoseWhereTheMatchIsRejected) {
  const Ground ground = rocky_ground(), other = rocky_ground(17);
  MapMerger merger = make_merger();
  ASSERT_TRUE(visit(merger, ground, 0));
  const Pose at = pose_on_ground(other, 1, 0.2, 0.1);
  const auto second = merger.add(points_at(other, at, 2), {}, {at, covariance_of(0.08, 0.02)});
  ASSERT_TRUE(second);
  EXPECT_FALSE(second->decided());
  EXPECT_EQ(merger.map().stops().size(), 2U) << "the map is fused nevertheless";
  const bool unchanged = second->corrected.pose.matrix() == at.matrix();
  EXPECT_TRUE(second->constraint || unchanged);
}

TEST(MapMerger, UndeterminedDirectionsKeepThePrior) {
  const Ground dunes = [](double x, double) { return 0.06 * std::sin(2.1 * x) + 0.03 * std::sin(5.3 * x + 1); };
  MapMerger merger = make_merger();
  const Pose a = pose_on_ground(dunes, 0, 0, 0), b = pose_on_ground(dunes, 1, 0, 0);
  ASSERT_TRUE(merger.add(points_at(dunes, a, 1), {}, {a, Matrix6d::Zero()}));
  const UncertainPose prior{Pose::from_translation({0.1, 0.07, 0.02}) * b, covariance_of(0.08, 0.01)};
  const auto second = merger.add(points_at(dunes, b, 2), {}, prior);
  ASSERT_TRUE(second);
  EXPECT_EQ(name_of(second->match.status), "flat");
  const Eigen::Vector3d wrong = second->corrected.pose.translation() - b.translation();
  EXPECT_NEAR(wrong.x(), 0, 0.005);
  EXPECT_NEAR(wrong.y(), 0.07, 0.01);
  EXPECT_NEAR(wrong.z(), 0, 0.005);
  EXPECT_NEAR(std::sqrt(second->corrected.covariance(1, 1)), 0.08, 0.005);
  EXPECT_LT(std::sqrt(second->corrected.covariance(0, 0)), 0.02);
}

// The position along a slope is not what a wrong height says.
TEST(MapMerger, AFlatMatchDoesNotMoveThePoseInUndeterminedDirections) {
  const Ground dunes = [](double x, double y) {
    return 0.06 * std::sin(2.1 * x) + 0.03 * std::sin(5.3 * x + 1) + 0.02 * y;
  };
  MapMerger merger = make_merger();
  const Pose a = pose_on_ground(dunes, 0, 0, 0), b = pose_on_ground(dunes, 1, 0, 0);
  ASSERT_TRUE(merger.add(points_at(dunes, a, 1), {}, {a, Matrix6d::Zero()}));
  // 5 cm too high, which is the same as 2.5 m along the slope.
  UncertainPose prior{Pose::from_translation({0, 0, 0.05}) * b, covariance_of(0.4, 0.01)};
  prior.covariance(2, 2) = 4e-6;
  const auto second = merger.add(points_at(dunes, b, 2), {}, prior);
  ASSERT_TRUE(second);
  EXPECT_EQ(name_of(second->match.status), "flat");
  EXPECT_LT(std::abs(second->corrected.pose.translation().y() - b.translation().y()), 0.05);
}

// All the tables of a store.
Bytes bytes_of(TileStore& store) {
  ArchiveWriter out;
  const auto index = store.index();
  for (const TileStore::Entry& entry : *index) {
    out.put(entry.key.submap);
    out.put(entry.key.x);
    out.put(entry.key.y);
    out.put(entry.revision);
    const Bytes tile = to_bytes(*store.read(entry));
    out.put_array(tile.data(), tile.size());
  }
  const auto stops = store.stops();
  for (const MapStop& stop : *stops) {
    out.put(stop.world_from_body.pose);
    out.put(stop.world_from_body.covariance);
  }
  return out.take();
}

TEST(MapMerger, ResumesAfterSavingWithTheSameResult) {
  const Ground ground = rocky_ground();
  const TemporaryFolder folder;
  Database straight_db = *Database::open(folder.file("uninterrupted"), Database::Mode::create),
           db = *Database::open(folder.file("resumed"), Database::Mode::create);
  TileStore straight_store = *TileStore::open(straight_db), store = *TileStore::open(db);
  MapMerger uninterrupted = make_merger();
  uninterrupted.page_to(&straight_store);
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(visit(uninterrupted, ground, i));
    ASSERT_TRUE(uninterrupted.flush());
  }
  Bytes memory;
  {
    MapMerger before = make_merger();
    before.page_to(&store);
    for (int i = 0; i < 2; ++i) {
      ASSERT_TRUE(visit(before, ground, i));
      ASSERT_TRUE(before.flush());
    }
    memory = before.save();
    ASSERT_TRUE(visit(before, ground, 2)) << "never flushed, so it is lost";
  }
  MapMerger resumed = make_merger();
  ASSERT_TRUE(resumed.restore(memory, store));
  ASSERT_TRUE(visit(resumed, ground, 2));
  ASSERT_TRUE(resumed.flush());
  EXPECT_EQ(bytes_of(store), bytes_of(straight_store));
  EXPECT_EQ(resumed.save(), uninterrupted.save());

  EXPECT_THAT(make_merger().restore(memory, store).error().message(), HasSubstr("does not fit"))
      << "the tables have changed since";
  memory[0] = 7;
  EXPECT_THAT(make_merger().restore(memory, store).error().message(), HasSubstr("version 7"));
  EXPECT_FALSE(make_merger().restore({}, store));
}

TEST(MapMerger, RefusesOptionsOutOfBounds) {
  SlamOptions slam;
  slam.match.step_m = 0;
  EXPECT_THAT(testing::error_message(MapMerger::create(slam, {}, ThreadPool(1))),
              HasSubstr("SLAM options: match.step_m is 0"));
  MapOptions map;
  map.cell_m = 0;
  EXPECT_THAT(testing::error_message(MapMerger::create({}, map, ThreadPool(1))), HasSubstr("map options: cell_m is 0"));
}

}  // namespace
}  // namespace spartan
