#include "spartan/system/internal/stop_stage.h"

#include <gtest/gtest.h>

namespace spartan::internal {
namespace {

const RectifiedStereo kStereo{{64, 48}, 60, {31.5, 23.5}, 0.1};
constexpr double kNearest_m = 0.4;

// Black images: their content does not matter here.
struct TestImages {
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

Bytes saved(const StopStage& stage) {
  ArchiveWriter out;
  stage.save(out);
  return out.take();
}

// Neither the view nor the first frame of the stop is retained; the first frame becomes a view only with another one.
TEST(StopStage, RejectedViewLeavesStateUnchanged) {
  StopStage stage(StopMapper::create({}, {}, ThreadPool(1)).value());
  const TestImages images;
  TestImages wrong_size;
  wrong_size.right = Image<std::uint8_t>(60, 48);
  ASSERT_TRUE(stage.add_odometry_frame(1, images.pair(0), kNearest_m, {}, {}));
  const Bytes before = saved(stage);
  const Status refused = stage.add_view(1, "wide", wrong_size.pair(1), kNearest_m);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::frame_rejected);
  EXPECT_EQ(saved(stage), before);
  EXPECT_TRUE(stage.mapper().views().empty()) << "no view was added";
}

// The check is done when the view is added, not when the odometry pair reaches the stop.
TEST(StopStage, EarlyViewIsRejectedWhenAdded) {
  StopStage stage(StopMapper::create({}, {}, ThreadPool(1)).value());
  const TestImages images;
  TestImages wrong_size;
  wrong_size.left = Image<std::uint8_t>(64, 40);
  ASSERT_TRUE(stage.add_view(1, "wide", images.pair(0), kNearest_m));
  const Bytes before = saved(stage);
  EXPECT_FALSE(stage.add_view(1, "wide", wrong_size.pair(1), kNearest_m));
  EXPECT_FALSE(stage.add_view(2, "wide", wrong_size.pair(2), kNearest_m));
  EXPECT_EQ(saved(stage), before) << "the view of the next stop is retained";
  ASSERT_TRUE(stage.add_odometry_frame(1, images.pair(3), kNearest_m, {}, {}));
  EXPECT_EQ(stage.mapper().views().size(), 2U);
}

// The odometry pair's first frame is also a view of the stop.
TEST(StopStage, RejectedFirstFrameLeavesStateUnchanged) {
  StopStage stage(StopMapper::create({}, {}, ThreadPool(1)).value());
  const TestImages images;
  TestImages wrong_size;
  wrong_size.right = Image<std::uint8_t>(64, 40);
  ASSERT_TRUE(stage.add_view(1, "wide", images.pair(0), kNearest_m));
  const Bytes before = saved(stage);
  EXPECT_FALSE(stage.add_odometry_frame(1, wrong_size.pair(1), kNearest_m, {}, {}));
  EXPECT_EQ(saved(stage), before);
  EXPECT_EQ(stage.position_id(), -1);
}

}  // namespace
}  // namespace spartan::internal
