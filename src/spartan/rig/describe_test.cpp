#include "spartan/rig/describe.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

namespace spartan {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kDegree = std::numbers::pi / 180;

Camera camera(const std::string& name) {
  Camera made;
  made.name = name;
  made.size = {640, 480};
  made.model = PinholeModel{500, 490, 319.5, 239.5};
  return made;
}

// `left_from_right` as the file has it; what a person got wrong comes in here.
Rig rig_with(const Pose& left_from_right) {
  return rig_of_one_pair("front", camera("left"), camera("right"), left_from_right.inverse());
}

Pose turned(double about_x_deg, double about_y_deg, double about_z_deg, const Eigen::Vector3d& t = {0, 0, 0}) {
  return {exp_so3({about_x_deg * kDegree, about_y_deg * kDegree, about_z_deg * kDegree}), t};
}

TEST(Describe, PlacesOfTheOtherEyeInWords) {
  EXPECT_EQ(describe_relative_pose(Pose::from_translation({0.12, -0.0003, -0.0001})),
            "120.0 mm to the right, 0.3 mm up, 0.1 mm back; not turned");
  EXPECT_EQ(describe_relative_pose(Pose::from_translation({-1.5, 0.002, 0.003})),
            "1.500 m to the left, 2.0 mm down, 3.0 mm ahead; not turned");
  EXPECT_EQ(describe_relative_pose(Pose()), "at the same place; not turned");
}

// x right, y down, z ahead: about +y the view goes to the right, about +x up, about +z its top goes to the right.
TEST(Describe, TurnsInWords) {
  EXPECT_THAT(describe_relative_pose(turned(0, 0.02, 0)), HasSubstr("; turned 0.020° to the right"));
  EXPECT_THAT(describe_relative_pose(turned(0, -2, 0)), HasSubstr("; turned 2.00° to the left"));
  EXPECT_THAT(describe_relative_pose(turned(0.1, 0, 0)), HasSubstr("; turned 0.100° up"));
  EXPECT_THAT(describe_relative_pose(turned(-0.1, 0, 0)), HasSubstr("; turned 0.100° down"));
  EXPECT_THAT(describe_relative_pose(turned(0, 0, 3)), HasSubstr("; turned 3.00° clockwise"));
  EXPECT_THAT(describe_relative_pose(turned(0, 0, -3)), HasSubstr("; turned 3.00° counter-clockwise"));
}

TEST(Describe, FiguresOfAPair) {
  const Rig rig = rig_with(Pose::from_translation({0.12, 0, 0}));
  const PairSummary summary = summarize_pair(rig, rig.pairs[0]);
  EXPECT_NEAR(summary.baseline_m, 0.12, 1e-15);
  EXPECT_NEAR(summary.focal_px, 500, 1e-9);
  EXPECT_NEAR(summary.hfov_deg, 2 * std::atan(320.0 / 500) / kDegree, 1e-9);
  EXPECT_NEAR(summary.vfov_deg, 2 * std::atan(240.0 / 490) / kDegree, 1e-9);
}

TEST(Describe, RangeResolution) {
  const auto sentences = describe_rig(rig_with(Pose::from_translation({0.12, 0, 0})));
  // 2² m² · 0.3 px / (500 px · 0.12 m) = 20 mm
  EXPECT_THAT(sentences, Contains(HasSubstr("0.3 px of disparity are 1.2 mm at 0.5 m, 5.0 mm at 1 m, 20.0 mm at 2 m")));
}

TEST(Describe, SoundPairsRaiseNoDoubt) {
  const Rig rig = rig_with(turned(0.2, 0.5, 0.1, {0.12, 0.001, 0.002}));
  EXPECT_THAT(describe_doubts(rig, rig.pairs[0]), IsEmpty());
}

TEST(Describe, MistakesAreDoubted) {
  const auto doubts = [](const Pose& pose) {
    std::string text;
    const Rig rig = rig_with(pose);
    for (const std::string& sentence : describe_doubts(rig, rig.pairs[0])) text += sentence;
    return text;
  };
  EXPECT_THAT(doubts(Pose::from_translation({-0.12, 0, 0})), HasSubstr("LEFT of the left one"));
  EXPECT_THAT(doubts(Pose::from_translation({120, 0, 0})), HasSubstr("given in millimetres? It would be 120.0 mm"));
  EXPECT_THAT(doubts(Pose::from_translation({0.001, 0.12, 0})), HasSubstr("in other axes"));
  EXPECT_THAT(doubts(turned(0, 20, 0, {0.12, 0, 0})), HasSubstr("turned by 20.00°"));
}

TEST(Describe, CamerasAndMastInWords) {
  Rig rig = rig_with(Pose::from_translation({0.2, 0, 0}));
  rig.pan_tilt_units = {{"mast", Pose::from_translation({0, 0, 1}), 0.0, 39 * kDegree}};
  for (Camera& c : rig.cameras) c.mount = "mast";
  rig.cameras[0].self_mask = "mask.png";
  rig.cameras[1].pixel_format.bits = 12;
  rig.pairs[0].nearest_m = 1;
  rig.pairs[0].for_odometry = false;
  const auto sentences = describe_rig(rig);
  EXPECT_THAT(sentences, Contains(HasSubstr("pan-tilt unit mast: 0.000 m ahead, 0.000 m to the left, 1.000 m above")));
  EXPECT_THAT(sentences, Contains(HasSubstr("1.000 m above; looks 39.00° down (on 'mast', at its angles of rest)")));
  EXPECT_THAT(sentences,
              Contains(HasSubstr("camera left: pinhole, 640 x 480 px, gray, with a self-mask; view 65.24°")));
  EXPECT_THAT(sentences, Contains(HasSubstr("gray of 12 bits")));
  EXPECT_THAT(sentences, Contains(HasSubstr("nothing nearer than 1 m has to be matched: 100 px")));
  EXPECT_THAT(sentences, Contains(HasSubstr("not for the odometry")));
}

}  // namespace
}  // namespace spartan
