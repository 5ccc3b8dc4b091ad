#include "spartan/rig/describe.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "spartan/core/pose.h"

namespace spartan {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Camera camera(const std::string& name) {
  Camera made;
  made.name = name;
  made.size = {640, 480};
  made.model = PinholeModel{500, 490, 319.5, 239.5};
  return made;
}

// `left_from_right` as in the file, right or wrong.
Rig rig_with(const Pose& left_from_right) {
  return rig_of_one_pair("front", camera("left"), camera("right"), left_from_right.inverse());
}

Pose rotated(double about_x_deg, double about_y_deg, double about_z_deg, const Eigen::Vector3d& t = {0, 0, 0}) {
  return {exp_so3({about_x_deg * kRadiansPerDegree, about_y_deg * kRadiansPerDegree, about_z_deg * kRadiansPerDegree}),
          t};
}

TEST(Describe, RelativePositions) {
  EXPECT_EQ(describe_relative_pose(Pose::from_translation({0.12, -0.0003, -0.0001})),
            "120.0 mm to the right, 0.3 mm up, 0.1 mm back; not rotated");
  EXPECT_EQ(describe_relative_pose(Pose::from_translation({-1.5, 0.002, 0.003})),
            "1.500 m to the left, 2.0 mm down, 3.0 mm ahead; not rotated");
  EXPECT_EQ(describe_relative_pose(Pose()), "at the same position; not rotated");
}

// x right, y down, z forward: a rotation about +y turns the axis to the right, about +x up, about +z is clockwise.
TEST(Describe, RelativeRotations) {
  EXPECT_THAT(describe_relative_pose(rotated(0, 0.02, 0)), HasSubstr("; rotated 0.020° to the right"));
  EXPECT_THAT(describe_relative_pose(rotated(0, -2, 0)), HasSubstr("; rotated 2.00° to the left"));
  EXPECT_THAT(describe_relative_pose(rotated(0.1, 0, 0)), HasSubstr("; rotated 0.100° up"));
  EXPECT_THAT(describe_relative_pose(rotated(-0.1, 0, 0)), HasSubstr("; rotated 0.100° down"));
  EXPECT_THAT(describe_relative_pose(rotated(0, 0, 3)), HasSubstr("; rotated 3.00° clockwise"));
  EXPECT_THAT(describe_relative_pose(rotated(0, 0, -3)), HasSubstr("; rotated 3.00° counter-clockwise"));
}

TEST(Describe, SummaryOfAPair) {
  const Rig rig = rig_with(Pose::from_translation({0.12, 0, 0}));
  const PairSummary summary = summarize_pair(rig, rig.pairs[0]);
  EXPECT_NEAR(summary.baseline_m, 0.12, 1e-15);
  EXPECT_NEAR(summary.focal_px, 500, 1e-9);
  EXPECT_NEAR(summary.hfov_deg, 2 * std::atan(320.0 / 500) / kRadiansPerDegree, 1e-9);
  EXPECT_NEAR(summary.vfov_deg, 2 * std::atan(240.0 / 490) / kRadiansPerDegree, 1e-9);
}

TEST(Describe, RangeResolution) {
  const auto lines = describe_rig(rig_with(Pose::from_translation({0.12, 0, 0})));
  // 2² m² · 0.3 px / (500 px · 0.12 m) = 20 mm
  EXPECT_THAT(
      lines,
      Contains(HasSubstr("range resolution for 0.3 px of disparity: 1.2 mm at 0.5 m, 5.0 mm at 1 m, 20.0 mm at 2 m")));
}

TEST(Describe, CorrectPairsHaveNoFindings) {
  const Rig rig = rig_with(rotated(0.2, 0.5, 0.1, {0.12, 0.001, 0.002}));
  EXPECT_THAT(describe_plausibility(rig, rig.pairs[0]), IsEmpty());
}

TEST(Describe, SuspiciousPairsAreReported) {
  const auto findings = [](const Pose& pose) {
    std::string text;
    const Rig rig = rig_with(pose);
    for (const std::string& line : describe_plausibility(rig, rig.pairs[0])) text += line;
    return text;
  };
  EXPECT_THAT(findings(Pose::from_translation({-0.12, 0, 0})), HasSubstr("LEFT of the left one"));
  EXPECT_THAT(findings(Pose::from_translation({120, 0, 0})),
              HasSubstr("given in millimetres: it would then be 120.0 mm"));
  EXPECT_THAT(findings(Pose::from_translation({0.001, 0.12, 0})), HasSubstr("axis convention"));
  EXPECT_THAT(findings(rotated(0, 20, 0, {0.12, 0, 0})), HasSubstr("rotated by 20.00°"));
}

TEST(Describe, CamerasAndMast) {
  Rig rig = rig_with(Pose::from_translation({0.2, 0, 0}));
  rig.pan_tilt_units = {{"mast", Pose::from_translation({0, 0, 1}), 0.0, 39 * kRadiansPerDegree}};
  for (Camera& c : rig.cameras) c.mount = "mast";
  rig.cameras[0].self_mask = "mask.png";
  rig.cameras[1].pixel_format.bits = 12;
  rig.pairs[0].nearest_m = 1;
  rig.pairs[0].for_odometry = false;
  const auto lines = describe_rig(rig);
  EXPECT_THAT(lines, Contains(HasSubstr("pan-tilt unit mast: 0.000 m ahead, 0.000 m to the left, 1.000 m above")));
  EXPECT_THAT(lines, Contains(HasSubstr("1.000 m above; optical axis 39.00° down (on 'mast', at its rest angles)")));
  EXPECT_THAT(lines,
              Contains(HasSubstr("camera left: pinhole, 640 x 480 px, gray, with a self-mask; field of view 65.24°")));
  EXPECT_THAT(lines, Contains(HasSubstr("gray with 12 bits")));
  EXPECT_THAT(lines, Contains(HasSubstr("nearest depth to match 1 m: 100 px")));
  EXPECT_THAT(lines, Contains(HasSubstr("not used for odometry")));
}

}  // namespace
}  // namespace spartan
