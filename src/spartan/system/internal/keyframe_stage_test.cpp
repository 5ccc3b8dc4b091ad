#include "spartan/system/internal/keyframe_stage.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "spartan/core/archive.h"

namespace spartan::internal {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

// Optical frame of a camera that looks along the direction `heading`, level.
Pose level_camera(double x, double y, double heading) {
  Eigen::Matrix3d world_from_left;  // columns: right, down, forward
  world_from_left << std::sin(heading), 0, std::cos(heading), -std::cos(heading), 0, std::sin(heading), 0, -1, 0;
  return Pose(Eigen::Quaterniond(world_from_left), Eigen::Vector3d(x, y, 1));
}

RectifiedStereo stereo() {
  return {{640, 480}, 320, {319.5, 239.5}, 0.1};  // 90° wide
}

TEST(GroundSector, LooksAlongTheOpticalAxis) {
  const GroundSector sector = ground_sector(stereo(), level_camera(1, 2, 90 * kDegree), 10);
  EXPECT_NEAR(sector.heading_rad, 90 * kDegree, 1e-12);
  EXPECT_NEAR(sector.half_angle_rad, 45 * kDegree, 1e-12);
  EXPECT_TRUE(sector.contains({1, 11}));
  EXPECT_FALSE(sector.contains({1, 13})) << "too far";
  EXPECT_FALSE(sector.contains({11, 3})) << "beside";
  EXPECT_FALSE(sector.contains({1, -5})) << "behind";
}

TEST(GroundSector, OfACameraThatLooksDownIsADisc) {
  const Pose down(Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX())),
                  Eigen::Vector3d(0, 0, 5));
  const GroundSector sector = ground_sector(stereo(), down, 3);
  for (const double angle : {0.0, 1.5, 3.0, -2.0})
    EXPECT_TRUE(sector.contains(2.9 * Eigen::Vector2d(std::cos(angle), std::sin(angle))));
}

TEST(NewGround, GrowsWithDistanceAndRotation) {
  const auto share = [](double x, double y, double heading) {
    return new_ground(ground_sector(stereo(), level_camera(x, y, heading), 10),
                      ground_sector(stereo(), level_camera(0, 0, 0), 10));
  };
  EXPECT_EQ(share(0, 0, 0), 0);
  EXPECT_EQ(share(30, 0, 0), 1);
  EXPECT_EQ(share(0, 0, 180 * kDegree), 1);
  EXPECT_GT(share(4, 0, 0), share(2, 0, 0));
  EXPECT_GT(share(0, 0, 40 * kDegree), share(0, 0, 20 * kDegree));
  // A sector of 90° that is turned by 45° about its camera has half of its area outside.
  EXPECT_NEAR(share(0, 0, 45 * kDegree), 0.5, 0.06);
  EXPECT_NEAR(share(0, 0, -45 * kDegree), 0.5, 0.06);
}

struct Stage {
  explicit Stage(const KeyframeOptions& options)
      : stage(StopMapper::create({}, {}, ThreadPool(1)).value(), options, 20), image(640, 480, 90) {
    frame.geometry = stereo();
    frame.left = frame.right = image.view();
  }
  KeyframeStage stage;
  Image<std::uint8_t> image;
  RectifiedPair frame;
};

TEST(KeyframeStage, TakesTheFirstFrameThenByDistanceTurnOrNewGround) {
  KeyframeOptions by_distance;
  by_distance.new_ground = 1;
  by_distance.turn_deg = 180;
  Stage s(by_distance);
  ASSERT_TRUE(s.stage.is_due(s.frame, level_camera(0, 0, 0)));
  s.stage.begin(s.frame, level_camera(0, 0, 0), {}, {});
  s.stage.clear();
  EXPECT_FALSE(s.stage.is_due(s.frame, level_camera(4.9, 0, 0)));
  EXPECT_TRUE(s.stage.is_due(s.frame, level_camera(5.1, 0, 0))) << "a quarter of 20 m";

  KeyframeOptions by_turn;
  by_turn.every_m = 1000;
  by_turn.new_ground = 1;
  Stage t(by_turn);
  t.stage.begin(t.frame, level_camera(0, 0, 0), {}, {});
  t.stage.clear();
  EXPECT_FALSE(t.stage.is_due(t.frame, level_camera(0, 0, 19 * kDegree)));
  EXPECT_TRUE(t.stage.is_due(t.frame, level_camera(0, 0, 21 * kDegree)));

  KeyframeOptions by_ground;
  by_ground.every_m = 1000;
  by_ground.turn_deg = 180;
  Stage g(by_ground);
  g.stage.begin(g.frame, level_camera(0, 0, 0), {}, {});
  g.stage.clear();
  EXPECT_FALSE(g.stage.is_due(g.frame, level_camera(0.5, 0, 0)));
  EXPECT_TRUE(g.stage.is_due(g.frame, level_camera(9, 0, 0)));
}

TEST(KeyframeStage, IsReadyAfterTheDelayAlsoWhenRestored) {
  KeyframeOptions options;
  options.delay_frames = 2;
  Stage s(options);
  s.stage.begin(s.frame, level_camera(0, 0, 0), {}, {});
  s.stage.advance({});
  EXPECT_FALSE(s.stage.is_ready());
  ArchiveWriter out;
  s.stage.save(out);
  Stage restored(options);
  const Bytes bytes = out.take();
  ArchiveReader in(bytes);
  restored.stage.restore(in);
  ASSERT_TRUE(in.finish("state"));
  EXPECT_TRUE(restored.stage.pending_frame()) << "the images are needed again";
  restored.stage.advance({});
  EXPECT_FALSE(restored.stage.is_ready()) << "without images";
  restored.stage.restore_frame(restored.frame);
  EXPECT_FALSE(restored.stage.pending_frame());
  EXPECT_TRUE(restored.stage.is_ready());
}

TEST(KeyframeStage, IsReadyWhereTheNextOneIsDue) {
  KeyframeOptions options;
  options.delay_frames = 5;
  Stage s(options);
  s.stage.begin(s.frame, level_camera(0, 0, 0), {}, {});
  s.stage.advance({});
  EXPECT_FALSE(s.stage.is_ready());
  s.stage.hurry();
  EXPECT_TRUE(s.stage.is_ready());
}

}  // namespace
}  // namespace spartan::internal
