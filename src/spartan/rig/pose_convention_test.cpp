#include <gtest/gtest.h>

#include "spartan/rig/rig.h"

namespace spartan {
namespace {

Rig one_pair() {
  Camera left, right;
  left.name = "left";
  right.name = "right";
  left.size = right.size = {640, 480};
  left.model = right.model = PinholeModel{500, 500, 320, 240};
  return rig_of_one_pair("rig", left, right, Pose::from_translation({-0.1, 0, 0}));
}

// A motion ahead and to the left with a left turn: in KITTI's optical frame z is forward, −x left, and a left turn is
// about −y. The world frame has no effect: KITTI's poses are relative to the first left camera.
TEST(PoseConvention, LeftOpticalIsThatOfKitti) {
  const Pose moved(exp_so3({0, 0, 0.3}), {1, 0.5, 0.2});
  for (const Pose& start : {Pose(), Pose(exp_so3({0.2, -0.1, 0.4}), {5, 6, 7})}) {
    const Trajectory kitti = in_recording_convention(one_pair(), {{Stamp{0}, start}, {Stamp{1}, start * moved}});
    ASSERT_EQ(kitti.size(), 2u);
    EXPECT_EQ(kitti[1].stamp.ns, 1);
    EXPECT_LE((kitti[0].pose.matrix() - Eigen::Matrix4d::Identity()).norm(), 1e-12);
    EXPECT_LE((kitti[1].pose.translation() - Eigen::Vector3d(-0.5, -0.2, 1)).norm(), 1e-12);
    EXPECT_LE((log_so3(kitti[1].pose.rotation()) - Eigen::Vector3d(0, -0.3, 0)).norm(), 1e-12);
  }
  EXPECT_TRUE(in_recording_convention(one_pair(), {}).empty());
}

TEST(PoseConvention, BodyIsUnchanged) {
  Rig rig = one_pair();
  rig.convention = PoseConvention::body;
  const Trajectory trajectory{{Stamp{5}, Pose(exp_so3({0.1, 0.2, 0.3}), {1, 2, 3})}};
  const Trajectory same = in_recording_convention(rig, trajectory);
  EXPECT_EQ(same[0].stamp, trajectory[0].stamp);
  EXPECT_EQ(same[0].pose.matrix(), trajectory[0].pose.matrix());
}

}  // namespace
}  // namespace spartan
