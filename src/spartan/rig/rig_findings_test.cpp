#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "spartan/core/pose.h"
#include "spartan/rig/describe.h"

namespace spartan {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr PinholeModel kCamera{500, 500, 319.5, 239.5};

Rig rig_of(const Pose& left_from_right, const CameraModel& right = kCamera) {
  Camera one, other;
  one.name = "left";
  other.name = "right";
  one.size = other.size = {640, 480};
  one.model = kCamera;
  other.model = right;
  return rig_of_one_pair("front", one, other, left_from_right.inverse());
}
std::vector<RigFinding> findings_of(const Rig& rig, ImageSize image_size = {}) {
  return plausibility_findings(rig, rig.pairs.front(), image_size);
}
// Expects exactly one finding, with this value.
void expect_finding(const Rig& rig, const std::string& id, double value) {
  const auto found = findings_of(rig);
  ASSERT_EQ(found.size(), 1u) << id;
  EXPECT_EQ(found[0].id, id) << found[0].text;
  EXPECT_NEAR(found[0].value, value, 1e-9 * std::abs(value)) << found[0].text;
}

TEST(RigFindings, RelativePoses) {
  EXPECT_TRUE(findings_of(rig_of(Pose::from_translation({0.12, 0.01, -0.02}))).empty());
  expect_finding(rig_of(Pose::from_translation({0.01, 0.12, 0})), "not_side_by_side", 0.12);
  expect_finding(rig_of(Pose::from_translation({0.01, 0, -0.12})), "not_side_by_side", 0.12);
  // For cameras above or behind each other the sides are not checked.
  expect_finding(rig_of(Pose::from_translation({-1e-18, 0.12, 0})), "not_side_by_side", 0.12);
  expect_finding(rig_of(Pose::from_translation({-0.01, 0, 0.12})), "not_side_by_side", 0.12);
  expect_finding(rig_of(Pose::from_translation({120, 0, 0})), "baseline_unit", 120);
  expect_finding(rig_of(Pose::from_translation({0.00012, 0, 0})), "baseline_unit", 0.00012);
  expect_finding(rig_of({exp_so3({0, 16 * kRadiansPerDegree, 0}), {0.12, 0, 0}}), "large_rotation", 16);
  EXPECT_TRUE(findings_of(rig_of({exp_so3({0, 14 * kRadiansPerDegree, 0}), {0.12, 0, 0}})).empty());
  const auto left = findings_of(rig_of(Pose::from_translation({-0.12, 0, 0})));
  ASSERT_EQ(left.size(), 2u) << "only images can decide";
  EXPECT_EQ(left[0].id, "inverse_transform");
  EXPECT_EQ(left[1].id, "swapped_eyes");
}

// Of either camera; here of the right one.
TEST(RigFindings, IntrinsicsOfAnotherImageSize) {
  const Pose beside = Pose::from_translation({0.12, 0, 0});
  expect_finding(rig_of(beside, PinholeModel{1000, 1000, 639, 479}), "size_mismatch", 0.5);
  expect_finding(rig_of(beside, PinholeModel{250, 250, 159.75, 119.75}), "size_mismatch", 2);
  expect_finding(rig_of(beside, PinholeModel{500, 250, 319.5, 239.5}), "size_mismatch", 2);
  expect_finding(rig_of(beside, PinholeModel{20, 20, 319.5, 239.5}), "size_mismatch",
                 2 * std::atan(16) / kRadiansPerDegree);
  expect_finding(rig_of(beside, PinholeModel{20000, 20000, 319.5, 239.5}), "size_mismatch",
                 2 * std::atan(0.016) / kRadiansPerDegree);
  expect_finding(rig_of(beside, RadialTangentialModel({6, 6, 319.5, 239.5}, {-0.28, 0.07})), "size_mismatch", 6);
  // An off-centre principal point or another focal length is plausible.
  EXPECT_TRUE(findings_of(rig_of(beside, PinholeModel{500, 500, 400, 180})).empty());
  EXPECT_TRUE(findings_of(rig_of(beside, PinholeModel{600, 600, 319.5, 239.5})).empty());
  const auto with_image_size = findings_of(rig_of(beside), {320, 240});
  ASSERT_EQ(with_image_size.size(), 1u) << "once, for both cameras are equal";
  EXPECT_EQ(with_image_size[0].value, 0.5);
}

// One finding per camera; one for both where they are equal.
TEST(RigFindings, EqualCamerasAreReportedOnce) {
  Rig rig = rig_of(Pose::from_translation({0.12, 0, 0}));
  for (Camera& c : rig.cameras) c.model = PinholeModel{492.8, 520.6, 319.5, 239.5};
  const auto equal = findings_of(rig);
  ASSERT_EQ(equal.size(), 1u);
  EXPECT_THAT(equal[0].text, HasSubstr("cameras left and right: fx is 492.8 and fy 520.6 px"));
  rig.cameras[1].model = PinholeModel{492.8, 520.7, 319.5, 239.5};
  const auto unequal = findings_of(rig);
  ASSERT_EQ(unequal.size(), 2u);
  EXPECT_THAT(unequal[0].text, HasSubstr("camera left: fx is"));
  EXPECT_THAT(unequal[1].text, HasSubstr("camera right: fx is"));
}

// A cropped image has an off-centre principal point; in the corner or outside of the image it is reported.
TEST(RigFindings, PrincipalPointsOutsideOfTheImage) {
  const auto of_centre = [](double cx, double cy) {
    return findings_of(rig_of(Pose::from_translation({0.12, 0, 0}), PinholeModel{500, 500, cx, cy}));
  };
  for (const auto& [cx, cy] : {std::pair{-2000., -3000.},
                               {0., 0.},
                               {-0.5, -0.5},
                               {-1., -1.},
                               {320., -1.},
                               {640., 240.},
                               {1500., 240.},
                               {320., 480.},
                               {0., 900.}}) {
    const auto found = of_centre(cx, cy);
    ASSERT_EQ(found.size(), 1u) << cx << ' ' << cy;
    EXPECT_EQ(found[0].id, "size_mismatch");
    EXPECT_NEAR(found[0].value, std::hypot(cx - 319.5, cy - 239.5), 1e-9);
    EXPECT_THAT(found[0].text, HasSubstr("camera right: the principal point ("));
    EXPECT_THAT(found[0].text, HasSubstr("the centre of 640 x 480 px"));
    EXPECT_THAT(found[0].text, Not(HasSubstr("(-0, ")));
    EXPECT_THAT(found[0].text, HasSubstr(std::abs(cx) + std::abs(cy) < 3 ? "at the corner" : "outside of the image"));
  }
  for (const auto& [cx, cy] : {std::pair{0., 240.}, {639., 240.}, {500., 3.}, {2., 479.}})
    EXPECT_TRUE(of_centre(cx, cy).empty()) << cx << ' ' << cy;
}

// The length in other units; the first one is used for the correction.
TEST(RigFindings, UnitsOfBaselines) {
  const auto text = [](double metres) { return findings_of(rig_of(Pose::from_translation({metres, 0, 0})))[0].text; };
  EXPECT_EQ(text(120),
            "a baseline of 120 m is probably given in millimetres: it would then be 120.0 mm (in centimetres 1.200 m)");
  EXPECT_EQ(text(12),
            "a baseline of 12 m is probably given in centimetres: it would then be 120.0 mm (in millimetres 12.0 mm)");
  EXPECT_EQ(text(0.00012), "a baseline of 0.00012 m was probably divided by 1000 twice: it would then be 120.0 mm");
  EXPECT_THAT(text(4.2), HasSubstr("Read as centimetres it would be 42.0 mm, as millimetres 4.2 mm"));
  EXPECT_THAT(text(4.2), HasSubstr("not changed"));
  EXPECT_EQ(likely_unit(30)->metres, 0.001);
  EXPECT_EQ(likely_unit(29.9)->metres, 0.01);
  EXPECT_EQ(likely_unit(10)->metres, 0.01);
  EXPECT_EQ(likely_unit(0.0049)->metres, 1000);
  for (const double plausible : {9.9, 0.005, 0.12}) EXPECT_FALSE(likely_unit(plausible)) << plausible;
}

}  // namespace
}  // namespace spartan
