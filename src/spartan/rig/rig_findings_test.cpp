#include "spartan/rig/rig_findings.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace spartan {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr PinholeModel kPinhole{500, 500, 319.5, 239.5};

Rig rig_with(const Pose& left_from_right, const CameraModel& right = kPinhole) {
  Camera one, other;
  one.name = "left";
  other.name = "right";
  one.size = other.size = {640, 480};
  one.model = kPinhole;
  other.model = right;
  return rig_of_one_pair("front", one, other, left_from_right.inverse());
}
std::vector<RigFinding> doubts(const Rig& rig, ImageSize picture = {}) {
  return find_doubts(rig, rig.pairs.front(), picture);
}
// The only doubt, with its figure.
void expect_doubt(const Rig& rig, const std::string& id, double value) {
  const auto found = doubts(rig);
  ASSERT_EQ(found.size(), 1u) << id;
  EXPECT_EQ(found[0].id, id) << found[0].text;
  EXPECT_NEAR(found[0].value, value, 1e-9 * std::abs(value)) << found[0].text;
}

TEST(RigFindings, PlacesOfTheEyes) {
  EXPECT_TRUE(doubts(rig_with(Pose::from_translation({0.12, 0.01, -0.02}))).empty());
  expect_doubt(rig_with(Pose::from_translation({0.01, 0.12, 0})), "not_beside", 0.12);
  expect_doubt(rig_with(Pose::from_translation({0.01, 0, -0.12})), "not_beside", 0.12);
  expect_doubt(rig_with(Pose::from_translation({120, 0, 0})), "baseline_unit", 120);
  expect_doubt(rig_with(Pose::from_translation({0.00012, 0, 0})), "baseline_unit", 0.00012);
  expect_doubt(rig_with({exp_so3({0, 16 * kDegree, 0}), {0.12, 0, 0}}), "eyes_apart", 16);
  EXPECT_TRUE(doubts(rig_with({exp_so3({0, 14 * kDegree, 0}), {0.12, 0, 0}})).empty());
  const auto left = doubts(rig_with(Pose::from_translation({-0.12, 0, 0})));
  ASSERT_EQ(left.size(), 2u) << "only pictures tell which";
  EXPECT_EQ(left[0].id, "inverse_transform");
  EXPECT_EQ(left[1].id, "swapped_eyes");
}

// Of either camera: here of the right one.
TEST(RigFindings, NumbersOfAnotherPictureSize) {
  const Pose beside = Pose::from_translation({0.12, 0, 0});
  expect_doubt(rig_with(beside, PinholeModel{1000, 1000, 639, 479}), "size_mismatch", 0.5);
  expect_doubt(rig_with(beside, PinholeModel{250, 250, 159.75, 119.75}), "size_mismatch", 2);
  expect_doubt(rig_with(beside, PinholeModel{500, 250, 319.5, 239.5}), "size_mismatch", 2);
  expect_doubt(rig_with(beside, PinholeModel{20, 20, 319.5, 239.5}), "size_mismatch", 2 * std::atan(16) / kDegree);
  expect_doubt(rig_with(beside, PinholeModel{20000, 20000, 319.5, 239.5}), "size_mismatch",
               2 * std::atan(0.016) / kDegree);
  // An axis that lies aside, or another lens, is no other size.
  EXPECT_TRUE(doubts(rig_with(beside, PinholeModel{500, 500, 400, 180})).empty());
  EXPECT_TRUE(doubts(rig_with(beside, PinholeModel{600, 600, 319.5, 239.5})).empty());
  const auto of_pictures = doubts(rig_with(beside), {320, 240});
  ASSERT_EQ(of_pictures.size(), 2u);
  EXPECT_EQ(of_pictures[1].value, 0.5);
}

}  // namespace
}  // namespace spartan
