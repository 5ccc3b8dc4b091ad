#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/sim/internal/world/rock_field.h"
#include "spartan/sim/scenario.h"

namespace spartan::sim {

using namespace internal;

namespace {

Rig rover() {
  const char* const root = std::getenv("SPARTAN_SOURCE_DIR");
  return read_rig_yaml(std::string(root != nullptr ? root : ".") + "/config/rigs/rover_square.yaml").value();
}

double path_end_heading(const PathOptions& path) {
  const auto drive = Drive::plan(path, {}, rover());
  return drive->at(drive->seconds()).heading;
}

TEST(Path, EveryKindHasTheExpectedEndPose) {
  const double degree = std::numbers::pi / 180;
  const auto end = [](const PathOptions& path) {
    const auto drive = Drive::plan(path, {}, rover());
    return drive->at(drive->seconds());
  };
  EXPECT_NEAR(end({.kind = PathKind::straight, .length_m = 3.217}).x, 3.217, 1e-9);
  const PlanarPose arc = end({.kind = PathKind::arc, .length_m = 4, .turn_deg = 90});
  const double radius = 4 / (std::numbers::pi / 2);
  EXPECT_NEAR(arc.x, radius, 1e-4);
  EXPECT_NEAR(arc.y, radius, 1e-4);
  EXPECT_NEAR(arc.heading, 90 * degree, 1e-9);
  const PlanarPose loop = end({.kind = PathKind::loop, .length_m = 48});
  EXPECT_NEAR(std::hypot(loop.x, loop.y), 0, 1e-3);
  EXPECT_NEAR(path_end_heading({.kind = PathKind::turn_in_place, .turn_deg = -50}), -50 * degree, 1e-9);
  const PlanarPose way = end({.kind = PathKind::waypoints, .waypoints_m = {2, 0.5, 4, 0}});
  EXPECT_NEAR(way.x, 4, 0.02);
  EXPECT_NEAR(way.y, 0, 0.02);
  // 1 right, 1.5 up, 2 left, 2.5 down
  const PlanarPose spiral = end({.kind = PathKind::square_spiral, .leg_m = 1, .growth_m = 0.5, .legs = 4});
  EXPECT_NEAR(spiral.x, 1 - 2, 1e-6);
  EXPECT_NEAR(spiral.y, 1.5 - 2.5, 1e-6);
  EXPECT_NEAR(Drive::plan({.kind = PathKind::stationary, .stationary_s = 12}, {}, rover())->seconds(),
              PathOptions().initial_stop_s + 12 + 1, 0.1);
}

TEST(Path, EndsEarlyOnTheSamePath) {
  PathOptions path{.kind = PathKind::loop, .length_m = 12};
  const auto whole = Drive::plan(path, {}, rover());
  path.end_after_m = 3;
  const auto early = Drive::plan(path, {}, rover());
  const PlanarPose end = early->at(early->seconds());
  const std::vector<PlanarPose> track = whole->track();
  EXPECT_TRUE(std::any_of(track.begin(), track.end(), [&](const PlanarPose& p) {
    return std::hypot(p.x - end.x, p.y - end.y) < 0.02 && std::abs(p.heading - end.heading) < 0.02;
  }));
  EXPECT_NEAR(end.heading, std::numbers::pi / 2, 1e-3) << "a quarter of the circle";
  path = {.kind = PathKind::square_spiral, .leg_m = 1, .growth_m = 0.5, .legs = 4};
  path.end_after_m = 1.8;
  const auto spiral = Drive::plan(path, {}, rover());
  EXPECT_NEAR(spiral->at(spiral->seconds()).y, 0.8, 1e-3) << "after the first corner";
}

TEST(Path, SpeedStaysBelowItsLimitAndBeginsAndEndsAtZero) {
  const PathOptions path{.kind = PathKind::winding, .length_m = 2, .swing_deg = 30, .wavelength_m = 2};
  const auto drive = Drive::plan(path, {}, rover());
  const auto speed = [&](double t) {
    const PlanarPose a = drive->at(t - 0.05), b = drive->at(t + 0.05);
    return std::hypot(b.x - a.x, b.y - a.y) / 0.1;
  };
  double fastest = 0;
  for (double t = 0.1; t < drive->seconds(); t += 0.1) fastest = std::max(fastest, speed(t));
  EXPECT_LT(fastest, path.speed_m_s * 1.01);
  EXPECT_GT(fastest, path.speed_m_s * 0.99);
  EXPECT_LT(speed(1), 1e-9);
  EXPECT_LT(speed(drive->seconds() - 0.1), 1e-9);
}

TEST(Drive, PlansAFrameEveryStepAndPansAtStops) {
  const auto drive =
      Drive::plan({.kind = PathKind::arc, .length_m = 4, .turn_deg = 40}, {.stops_m = {0, 1.5}}, rover());
  ASSERT_TRUE(drive) << drive.error().message();
  std::vector<PlanarPose> narrow;
  std::set<std::int64_t> stops;
  double last = -1;
  for (const PlannedFrame& frame : drive->frames()) {
    EXPECT_GE(frame.time_s, last);
    last = frame.time_s;
    if (frame.pair == "narrow") narrow.push_back(drive->at(frame.time_s));
    if (frame.pair == "wide") stops.insert(frame.position_id);
  }
  ASSERT_EQ(narrow.size(), 41U);
  for (std::size_t i = 1; i < narrow.size(); ++i)
    EXPECT_NEAR(std::hypot(narrow[i].x - narrow[i - 1].x, narrow[i].y - narrow[i - 1].y), 0.1, 0.001);
  ASSERT_EQ(stops.size(), 2U);
  for (const std::int64_t stop : stops) {
    std::vector<double> pans;
    int narrow_at_stop = 0;
    for (const PlannedFrame& frame : drive->frames()) {
      if (frame.position_id != stop) continue;
      if (frame.pair == "wide") {
        pans.push_back(frame.pan_rad * 180 / std::numbers::pi);
      } else {
        ++narrow_at_stop;
      }
      EXPECT_NEAR(drive->at(frame.time_s - 0.4).x, drive->at(frame.time_s + 0.4).x, 1e-9)
          << "the rover must be stationary at the frames of a stop";
    }
    ASSERT_EQ(pans.size(), 3U);
    EXPECT_NEAR(pans[0], -35, 1e-9);
    EXPECT_NEAR(pans[2], 35, 1e-9);
    EXPECT_EQ(narrow_at_stop, 1);
  }
}

TEST(DriveCorridor, HasNoRocksAboveTheClearance) {
  const auto drive = Drive::plan({.kind = PathKind::straight, .length_m = 20}, {}, rover());
  RockField rocks({.coverage = 0.2}, 3);
  const Region strip{0, -0.2, 20, 0.2};
  const auto tall = [](const Rock& rock) { return rock.height_m > 0.05; };
  const auto before = rocks.rocks_in(strip);
  ASSERT_GT(std::count_if(before.begin(), before.end(), tall), 5);
  rocks.clear_corridor(DriveCorridor(drive->track(), 0.4), 0.05);
  const auto after = rocks.rocks_in(strip);
  EXPECT_EQ(std::count_if(after.begin(), after.end(), tall), 0);
  EXPECT_EQ(std::count_if(after.begin(), after.end(), [&](const Rock& r) { return !tall(r); }),
            std::count_if(before.begin(), before.end(), [&](const Rock& r) { return !tall(r); }));
}

TEST(NominalRig, HasTheErrorsOfItsOptions) {
  const Rig rig = rover();
  EXPECT_EQ(nominal_rig(rig, {}), rig);
  const Rig off = nominal_rig(rig, {.yaw_deg = 0.02, .row_offset_px = 0.3, .focal_percent = 0.1});
  const StereoPair& pair = *rig.find_pair("narrow");
  EXPECT_NEAR(rotation_angle(off.right_from_left(pair)) * 180 / std::numbers::pi, 0.02, 1e-9);
  const auto& left = std::get<PinholeModel>(off.find_camera(pair.left)->model);
  const auto& right = std::get<PinholeModel>(off.find_camera(pair.right)->model);
  const auto& truth = std::get<PinholeModel>(rig.find_camera(pair.left)->model);
  EXPECT_NEAR(left.fx / truth.fx, 1.001, 1e-12);
  EXPECT_NEAR(right.cy - truth.cy, 0.3, 1e-12);
  EXPECT_EQ(left.cy, truth.cy);
}

}  // namespace
}  // namespace spartan::sim
