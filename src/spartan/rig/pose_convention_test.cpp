#include "spartan/rig/pose_convention.h"

#include <gtest/gtest.h>

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

// A metre ahead and to the left, turned to the left: in KITTI's optical frame z is ahead, −x left, and turning to the
// left is about −y.
TEST(PoseConvention, LeftOpticalIsKittis) {
  const Pose body(exp_so3({0, 0, 0.3}), {1, 0.5, 0.2});
  const Pose kitti = in_recording_convention(one_pair(), body);
  EXPECT_LE((kitti.translation() - Eigen::Vector3d(-0.5, -0.2, 1)).norm(), 1e-12);
  EXPECT_LE((log_so3(kitti.rotation()) - Eigen::Vector3d(0, -0.3, 0)).norm(), 1e-12);
  const Pose start = in_recording_convention(one_pair(), Pose());
  EXPECT_LE((start.matrix() - Eigen::Matrix4d::Identity()).norm(), 1e-12);
}

TEST(PoseConvention, BodyStaysAsItIs) {
  Rig rig = one_pair();
  rig.convention = PoseConvention::body;
  const Trajectory trajectory{{Stamp{5}, Pose(exp_so3({0.1, 0.2, 0.3}), {1, 2, 3})}};
  const Trajectory same = in_recording_convention(rig, trajectory);
  EXPECT_EQ(same[0].stamp, trajectory[0].stamp);
  EXPECT_EQ(same[0].pose.matrix(), trajectory[0].pose.matrix());
}

}  // namespace
}  // namespace spartan
