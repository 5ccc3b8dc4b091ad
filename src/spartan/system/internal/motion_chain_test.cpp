#include "spartan/system/internal/motion_chain.h"

#include <gtest/gtest.h>

namespace spartan::internal {
namespace {

RelativeMotion motion_between(int from, int to, double sigma_m, bool keeps_reference = false) {
  Vector6d tangent;
  tangent << 0.1 * (to - from), 0.02, 0, 0, 0, 0.05 * (to - from);
  RelativeMotion motion;
  motion.from.ns = from;
  motion.to.ns = to;
  motion.previous_from_current = exp_se3(tangent);
  motion.covariance = sigma_m * sigma_m * Matrix6d::Identity();
  motion.keeps_reference = keeps_reference;
  return motion;
}

UncertainPose pose_of(const RelativeMotion& motion) {
  return {motion.previous_from_current, motion.covariance};
}

void expect_equal(const UncertainPose& a, const UncertainPose& b) {
  EXPECT_TRUE(a.pose.matrix().isApprox(b.pose.matrix(), 1e-12));
  EXPECT_TRUE(a.covariance.isApprox(b.covariance, 1e-12)) << a.covariance << "\n\n" << b.covariance;
}

TEST(MotionChain, ComposesMotions) {
  MotionChain chain;
  chain.start(motion_between(0, 1, 0.3));
  chain.add(motion_between(1, 2, 0.01));
  chain.add(motion_between(2, 3, 0.02));
  expect_equal(chain.first_from_last(),
               compose(pose_of(motion_between(1, 2, 0.01)), pose_of(motion_between(2, 3, 0.02))));
  EXPECT_EQ(chain.last_stamp().ns, 3);
}

TEST(MotionChain, ALostFrameAddsNoUncertaintyToThoseAfterIt) {
  MotionChain chain;
  chain.start(motion_between(0, 1, 0.3));
  chain.add(motion_between(1, 2, 1, true));
  expect_equal(chain.first_from_last(), pose_of(motion_between(1, 2, 1)));
  chain.add(motion_between(1, 3, 0.01));
  expect_equal(chain.first_from_last(), pose_of(motion_between(1, 3, 0.01)));
}

TEST(MotionChain, AMotionMayBeginAtALostFrame) {
  MotionChain chain;
  chain.start(motion_between(0, 1, 0.3));
  chain.add(motion_between(1, 2, 1, true));
  chain.add(motion_between(2, 3, 0.01));
  expect_equal(chain.first_from_last(), compose(pose_of(motion_between(1, 2, 1)), pose_of(motion_between(2, 3, 0.01))));
}

// The first frame was measured in the right image, say: the motions after it begin before it.
TEST(MotionChain, TheFirstFrameMayKeepItsReference) {
  MotionChain chain;
  chain.start(motion_between(0, 1, 0.02, true));
  expect_equal(chain.first_from_last(), {});
  chain.add(motion_between(0, 2, 0.01));
  expect_equal(chain.first_from_last(),
               compose(invert(pose_of(motion_between(0, 1, 0.02))), pose_of(motion_between(0, 2, 0.01))));
}

TEST(MotionChain, SavesItsState) {
  MotionChain chain;
  chain.start(motion_between(0, 1, 0.02, true));
  chain.add(motion_between(0, 2, 1, true));
  ArchiveWriter out;
  chain.save(out);
  const Bytes bytes = out.take();
  ArchiveReader in(bytes);
  MotionChain restored;
  restored.restore(in);
  ASSERT_TRUE(in.finish("the chain"));
  for (MotionChain* c : {&chain, &restored}) c->add(motion_between(0, 3, 0.01));
  EXPECT_EQ(chain.first_from_last().pose.matrix(), restored.first_from_last().pose.matrix());
  EXPECT_EQ(chain.first_from_last().covariance, restored.first_from_last().covariance);
  EXPECT_EQ(restored.last_stamp().ns, 3);
}

}  // namespace
}  // namespace spartan::internal
