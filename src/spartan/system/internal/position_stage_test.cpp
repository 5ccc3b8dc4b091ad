#include "spartan/system/internal/position_stage.h"

#include <gtest/gtest.h>

namespace spartan {
namespace {

const RectifiedStereo kStereo{{64, 48}, 60, {31.5, 23.5}, 0.1};
constexpr double kNearest_m = 0.4;

// Level ground would do; what is in the images does not matter here.
struct Shot {
  Image<std::uint8_t> left{64, 48}, right{64, 48};
  RectifiedPair pair(double seconds) const {
    RectifiedPair made;
    made.pair = "wide";
    made.stamp = Stamp::from_seconds(seconds);
    made.geometry = kStereo;
    made.left = left;
    made.right = right;
    made.body_from_left = Pose::from_translation({0, 0, 1}) * optical_from_forward().inverse();
    return made;
  }
};

Bytes saved(const PositionStage& stage) {
  ArchiveWriter out;
  stage.save(out);
  return out.take();
}

// Neither the view nor the first frame of the stop, which would have become a view with it, is kept.
TEST(PositionStage, AViewThatCannotBeMatchedChangesNothing) {
  PositionStage stage({}, {}, ThreadPool(1));
  const Shot shot;
  Shot unfit;
  unfit.right = Image<std::uint8_t>(60, 48);
  ASSERT_TRUE(stage.pass(1, shot.pair(0), kNearest_m, {}, {}));
  const Bytes before = saved(stage);
  const Status refused = stage.look(1, "wide", unfit.pair(1), kNearest_m);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::frame_rejected);
  EXPECT_EQ(saved(stage), before);
  EXPECT_TRUE(stage.mapper().views().empty()) << "nothing was looked at";
}

// It is refused when it comes, not when the odometry's pair reaches the stop.
TEST(PositionStage, AnEarlyViewThatCannotBeMatchedIsRefusedAtOnce) {
  PositionStage stage({}, {}, ThreadPool(1));
  const Shot shot;
  Shot unfit;
  unfit.left = Image<std::uint8_t>(64, 40);
  ASSERT_TRUE(stage.look(1, "wide", shot.pair(0), kNearest_m));
  const Bytes before = saved(stage);
  EXPECT_FALSE(stage.look(1, "wide", unfit.pair(1), kNearest_m));
  EXPECT_FALSE(stage.look(2, "wide", unfit.pair(2), kNearest_m));
  EXPECT_EQ(saved(stage), before) << "the view of the stop to come is still there";
  ASSERT_TRUE(stage.pass(1, shot.pair(3), kNearest_m, {}, {}));
  EXPECT_EQ(stage.mapper().views().size(), 2U);
}

// The odometry's own frame is a view of the stop, too.
TEST(PositionStage, AFirstFrameThatCannotBeMatchedChangesNothing) {
  PositionStage stage({}, {}, ThreadPool(1));
  const Shot shot;
  Shot unfit;
  unfit.right = Image<std::uint8_t>(64, 40);
  ASSERT_TRUE(stage.look(1, "wide", shot.pair(0), kNearest_m));
  const Bytes before = saved(stage);
  EXPECT_FALSE(stage.pass(1, unfit.pair(1), kNearest_m, {}, {}));
  EXPECT_EQ(saved(stage), before);
  EXPECT_EQ(stage.position_id(), -1);
}

}  // namespace
}  // namespace spartan
