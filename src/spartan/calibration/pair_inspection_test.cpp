#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "spartan/calibration/pair_check.h"
#include "spartan/core/pose.h"
#include "spartan/testing/synthetic_world.h"

namespace spartan {
namespace {

using ::testing::Contains;
using ::testing::Field;
using ::testing::HasSubstr;

const RectifiedStereo kStereo{{640, 480}, 520.0, {319.5, 239.5}, 0.12};

// The rig whose images the synthetic world renders, with the right camera pitched by an angle.
Rig rig_with_pitch(double pitch_rad) {
  Camera left, right;
  left.name = "left";
  right.name = "right";
  left.size = right.size = kStereo.size;
  left.model = right.model =
      PinholeModel{kStereo.focal_px, kStereo.focal_px, kStereo.centre_px.x(), kStereo.centre_px.y()};
  const Pose left_from_right(exp_so3({pitch_rad, 0, 0}), {kStereo.baseline_m, 0, 0});
  return rig_of_one_pair("front", left, right, left_from_right.inverse());
}

std::vector<testing::SyntheticFrame> rendered_frames() {
  const testing::SyntheticWorld world{testing::SyntheticWorldOptions()};
  std::vector<testing::SyntheticFrame> frames;
  for (const double x : {0.0, 3.0}) {
    const Pose tilted = Pose(exp_so3({0, 0.3, 0}), {x, 0, 0.6});
    frames.push_back(world.render(kStereo, tilted * optical_from_forward().inverse(), 1));
  }
  return frames;
}

// Two frames of one rectified pair, from different places; rendered once.
const std::vector<testing::SyntheticFrame>& two_frames() {
  static const std::vector<testing::SyntheticFrame> frames = rendered_frames();
  return frames;
}

std::vector<StereoViews> views_of(const std::vector<testing::SyntheticFrame>& frames) {
  std::vector<StereoViews> views;
  views.reserve(frames.size());
  for (const testing::SyntheticFrame& frame : frames) views.push_back({frame.left.view(), frame.right.view()});
  return views;
}

class PairInspectionOfImages : public ::testing::Test {
 protected:
  std::vector<StereoViews> views_ = views_of(two_frames());
};

TEST_F(PairInspectionOfImages, FindsNoFaultInATrueCalibration) {
  const Rig rig = rig_with_pitch(0);
  const auto result = inspect_pair(rig, rig.pairs.front(), views_, ThreadPool(1));
  ASSERT_TRUE(result) << result.error().message();
  EXPECT_TRUE(result->sufficient());
  EXPECT_EQ(name_of(result->check.grade), "good");
  EXPECT_LT(result->check.nominal_rows.mean_px, 0.3);
  ASSERT_EQ(result->matches.size(), 2u);
  EXPECT_EQ(static_cast<std::size_t>(result->check.matches), result->matches[0].size() + result->matches[1].size());
}

TEST_F(PairInspectionOfImages, FindsAndCorrectsAPitch) {
  const Rig rig = rig_with_pitch(0.3 * kRadiansPerDegree);
  const auto result = inspect_pair(rig, rig.pairs.front(), views_, ThreadPool(1));
  ASSERT_TRUE(result) << result.error().message();
  EXPECT_THAT(result->check.findings, Contains(Field(&RigFinding::id, "row_offset")));
  EXPECT_NEAR(std::abs(result->check.correction.pitch_rad), 0.3 * kRadiansPerDegree, 0.02 * kRadiansPerDegree);
  ASSERT_TRUE(result->check.corrected);
  const auto again = inspect_pair(*result->check.corrected, rig.pairs.front(), views_, ThreadPool(1));
  ASSERT_TRUE(again) << again.error().message();
  EXPECT_EQ(name_of(again->check.grade), "good");
}

// Pitch and roll are removed; a yaw, which rows hardly observe, is kept.
TEST_F(PairInspectionOfImages, AlignsRowsByPitchAndRollAlone) {
  const double degree = kRadiansPerDegree;
  Rig rig = rig_with_pitch(0);
  const Pose exact = rig.right_from_left(rig.pairs.front()).inverse();
  const Pose wrong(exact.rotation() * exp_so3({0.1 * degree, 0.05 * degree, -0.2 * degree}), exact.translation());
  rig.cameras[1].mount_from_camera = rig.cameras[0].mount_from_camera * wrong;
  const auto aligned = align_rows(rig, rig.pairs.front(), views_, ThreadPool(1));
  ASSERT_TRUE(aligned) << aligned.error().message();
  EXPECT_GT(aligned->given.mean_px, 0.7);
  EXPECT_LT(aligned->aligned.mean_px, 0.3);
  ASSERT_TRUE(aligned->rig);
  const Pose corrected = aligned->rig->right_from_left(rig.pairs.front()).inverse();
  const Eigen::Vector3d left = log_so3((exact.inverse() * corrected).rotation()) / degree;
  EXPECT_NEAR(left.x(), 0, 0.01);
  EXPECT_NEAR(left.y(), 0.05, 0.005);
  EXPECT_NEAR(left.z(), 0, 0.02);
  EXPECT_EQ(aligned->rig->cameras[0], rig.cameras[0]);
}

TEST_F(PairInspectionOfImages, KeepsACalibrationWhoseRowsAgree) {
  for (const double pitch_deg : {0.0, 0.02}) {
    const Rig rig = rig_with_pitch(pitch_deg * kRadiansPerDegree);
    const auto aligned = align_rows(rig, rig.pairs.front(), views_, ThreadPool(1));
    ASSERT_TRUE(aligned) << aligned.error().message();
    EXPECT_GT(aligned->inliers, 200);
    EXPECT_FALSE(aligned->rig) << "0.02 degrees are 0.2 px";
  }
}

// Frames of which left and right do not belong together.
TEST_F(PairInspectionOfImages, AlignsNothingByImagesOfDifferentPlaces) {
  const Rig rig = rig_with_pitch(0.3 * kRadiansPerDegree);
  std::swap(views_[0].right, views_[1].right);
  const auto aligned = align_rows(rig, rig.pairs.front(), views_, ThreadPool(1));
  ASSERT_TRUE(aligned) << aligned.error().message();
  EXPECT_FALSE(aligned->rig);
}

TEST_F(PairInspectionOfImages, NeedsNoCalibration) {
  const auto result = inspect_images(views_, ThreadPool(1));
  ASSERT_TRUE(result) << result.error().message();
  EXPECT_LT(result->check.corrected_rows.mean_px, 0.3);
}

TEST_F(PairInspectionOfImages, ReportsEachFrameAndIsIdenticalForAnyNumberOfThreads) {
  const Rig rig = rig_with_pitch(0);
  std::vector<std::size_t> reported;
  const auto one = inspect_pair(rig, rig.pairs.front(), views_, ThreadPool(1),
                                [&](std::size_t matched) { reported.push_back(matched); });
  const auto two = inspect_pair(rig, rig.pairs.front(), views_, ThreadPool(2));
  EXPECT_THAT(reported, ::testing::ElementsAre(1, 2));
  ASSERT_TRUE(one && two);
  EXPECT_EQ(one->check.row_error_px, two->check.row_error_px);
}

TEST_F(PairInspectionOfImages, RefusesUnknownPairsNoFramesAndDifferentSizes) {
  const Rig rig = rig_with_pitch(0);
  const StereoPair& pair = rig.pairs.front();
  StereoPair unknown = pair;
  unknown.name = "rear";
  const auto message = [&](const StereoPair& of, std::span<const StereoViews> frames) {
    const auto result = inspect_pair(rig, of, frames, ThreadPool(1));
    return result ? std::string() : result.error().message();
  };
  EXPECT_THAT(message(unknown, views_), HasSubstr("the rig has no pair 'rear'"));
  EXPECT_THAT(message(pair, {}), HasSubstr("there is no frame to match"));
  views_[1].right = {};
  EXPECT_THAT(message(pair, views_), HasSubstr("not all of one size"));
  EXPECT_FALSE(inspect_images({}, ThreadPool(1)));
}

}  // namespace
}  // namespace spartan
