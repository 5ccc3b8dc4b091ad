// Fault injection: common calibration errors must be found under their id and corrected.
#include "spartan/calibration/internal/model_modification.h"
#include "spartan/calibration/internal/pair_refinement.h"
#include "spartan/calibration/internal/simulated_pair_matches_test.h"
#include "spartan/calibration/pair_check.h"

namespace spartan {

using namespace internal;

namespace {

using ::testing::AnyOf;
using testing::check;
using ::testing::Contains;
using testing::distortion_free_rig;
using ::testing::Each;
using ::testing::ElementsAre;
using testing::expect_corrected;
using ::testing::HasSubstr;
using testing::ids;
using ::testing::IsEmpty;
using testing::left_from_right;
using ::testing::Not;
using testing::simulate_matches;
using testing::true_rig;
using testing::with_pose;

double focal_px(const Rig& rig) {
  return project_with_jacobian(rig.cameras[0].model, Eigen::Vector3d::UnitZ())->by_point(0, 0);
}

TEST(InjectedFault, InverseTransform) {
  const Rig truth = true_rig();
  const PairCheck result = check(with_pose(truth, left_from_right(truth).inverse()), simulate_matches(truth));
  EXPECT_THAT(ids(result), ElementsAre("inverse_transform"));
  EXPECT_EQ(result.grade, PairGrade::bad);
  expect_corrected(truth, result);
}

TEST(InjectedFault, SwappedImages) {
  const Rig truth = true_rig();
  std::vector<PixelMatch> matches = simulate_matches(truth);
  for (PixelMatch& match : matches) std::swap(match.left, match.right);
  const PairCheck result = check(truth, matches);
  EXPECT_THAT(ids(result), ElementsAre("swapped_eyes"));
  EXPECT_EQ(result.grade, PairGrade::bad);
  expect_corrected(truth, result);
}

TEST(InjectedFault, SwappedCamerasAndImages) {
  const Rig truth = true_rig();
  Rig rig = truth;
  std::swap(rig.pairs[0].left, rig.pairs[0].right);
  std::vector<PixelMatch> matches = simulate_matches(truth);
  for (PixelMatch& match : matches) std::swap(match.left, match.right);
  const PairCheck result = check(rig, matches);
  EXPECT_THAT(ids(result), ElementsAre("swapped_eyes"));
  EXPECT_EQ(result.corrected->pairs[0].left, "left");
  expect_corrected(truth, result);
}

// In millimetres, in centimetres, and in metres taken for millimetres.
TEST(InjectedFault, BaselineInOtherUnits) {
  const Rig truth = true_rig();
  const Pose pose = left_from_right(truth);
  for (const double factor : {1000.0, 100.0, 0.001}) {
    const PairCheck result =
        check(with_pose(truth, {pose.rotation(), factor * pose.translation()}), simulate_matches(truth));
    EXPECT_THAT(ids(result), ElementsAre("baseline_unit")) << factor;
    EXPECT_EQ(result.grade, PairGrade::bad);
    EXPECT_NEAR(left_from_right(*result.corrected).translation().norm(), 0.11, 0.001) << factor;
    expect_corrected(truth, result);
  }
}

TEST(InjectedFault, CamerasRotatedApart) {
  const Rig truth = true_rig();
  const PairCheck result = check(with_pose(truth, Pose(exp_so3({0, 20 * kRadiansPerDegree, 0}), {0.11, 0, 0})), {});
  EXPECT_THAT(ids(result), ElementsAre("large_rotation", "not_enough_texture"));
  EXPECT_EQ(result.grade, PairGrade::bad);
}

// The calibration of images twice as large: principal point and focal length, or the focal length alone.
TEST(InjectedFault, FocalLengthOfAnotherSize) {
  const Rig truth = true_rig();
  for (const bool scale_centre : {true, false}) {
    Rig rig = truth;
    for (Camera& c : rig.cameras) {
      auto numbers = parameters(c.model);
      for (double& f : numbers[0]) f *= 2;
      if (scale_centre) {
        for (double& v : numbers[1]) v = (v + 0.5) * 2 - 0.5;
      }
      c.model = with_parameters(c.model, numbers);
    }
    const PairCheck result = check(rig, simulate_matches(truth));
    EXPECT_THAT(ids(result), Contains("size_mismatch")) << scale_centre;
    EXPECT_EQ(result.grade, PairGrade::bad);
    expect_corrected(truth, result, 0.3);
  }
}

TEST(InjectedFault, ImagesOfAnotherSize) {
  const Rig truth = true_rig();
  const auto halved = [](std::vector<PixelMatch> matches) {
    for (PixelMatch& m : matches) {
      for (Eigen::Vector2d* p : {&m.left, &m.right}) *p = ((p->array() + 0.5) / 2 - 0.5).matrix();
    }
    return matches;
  };
  const ImageSize half{376, 240};
  const PairCheck result = check_pair(truth, truth.pairs[0], halved(simulate_matches(truth)), half);
  EXPECT_THAT(ids(result), ElementsAre("size_mismatch", "size_mismatch")) << "both cameras";
  EXPECT_EQ(result.grade, PairGrade::bad);
  const PairCheck again =
      check_pair(*result.corrected, result.corrected->pairs[0], halved(simulate_matches(truth, 700, 2)), half);
  EXPECT_THAT(ids(again), IsEmpty());
  EXPECT_EQ(again.grade, PairGrade::good);
}

// Of the right camera only: the intrinsics of the left one are right.
TEST(InjectedFault, OneCalibrationOfAnotherSize) {
  const Rig truth = true_rig();
  Rig rig = truth;
  rig.cameras[1].model = resized(rig.cameras[1].model, 0.5);
  rig.cameras[1].size = {376, 240};
  const PairCheck result = check(rig, simulate_matches(truth));
  EXPECT_THAT(ids(result), ElementsAre("size_mismatch"));
  EXPECT_EQ(result.corrected->cameras[0].model, truth.cameras[0].model);
  expect_corrected(truth, result);
}

// A focal length in millimetres, or a wrong fy: the finding's value is then an angle or fx/fy, not a size factor.
TEST(InjectedFault, ImplausibleFocalLengths) {
  const Rig truth = distortion_free_rig();
  for (const PinholeModel& odd : {PinholeModel{3, 3, 367.2, 248.4}, PinholeModel{458, 229, 367.2, 248.4}}) {
    Rig rig = truth;
    rig.cameras[0].model = odd;
    const PairCheck result = check(rig, simulate_matches(truth));
    EXPECT_THAT(ids(result), Contains("size_mismatch"));
    EXPECT_EQ(result.grade, PairGrade::bad);
    const auto principal_point = [](const Rig& r) { return *project(r.cameras[0].model, Eigen::Vector3d::UnitZ()); };
    EXPECT_EQ(principal_point(*result.corrected), principal_point(rig)) << "the image size is unchanged";
  }
}

// A crop of the right image that is not in the calibration, upwards and downwards, small and large. The rest of the
// calibration is right.
TEST(InjectedFault, RowShift) {
  const Rig truth = true_rig();
  for (const double rows_px : {2.0, -2.0, -5.0, 20.0, -20.0}) {
    Rig rig = truth;
    rig.cameras[1].model = with_row_offset(rig.cameras[1].model, rows_px);
    const PairCheck result = check(rig, simulate_matches(truth));
    EXPECT_THAT(ids(result), ElementsAre("row_offset")) << rows_px;
    EXPECT_NEAR(result.nominal_rows.median_px / rows_px, 1, 0.25) << "slightly more after undistortion";
    EXPECT_NEAR(result.findings.at(0).value, result.nominal_rows.median_px, 1e-9);
    EXPECT_THAT(result.findings.at(0).text,
                HasSubstr(rows_px > 0 ? "px below those of the right image" : "px above those of the right image"));
    EXPECT_EQ(result.grade, PairGrade::bad);
    EXPECT_NEAR(focal_px(*result.corrected), focal_px(truth), 1e-9);
    // A pitch explains small shifts equally well: two rows are 0.25°.
    expect_corrected(truth, result, std::max(0.4, std::abs(rows_px) / focal_px(truth) / kRadiansPerDegree + 0.15));
  }
}

TEST(InjectedFault, RowShiftAndInverseTransform) {
  const Rig truth = true_rig();
  Rig rig = with_pose(truth, left_from_right(truth).inverse());
  rig.cameras[1].model = with_row_offset(rig.cameras[1].model, -8);
  const PairCheck result = check(rig, simulate_matches(truth));
  EXPECT_THAT(ids(result), Contains("inverse_transform"));
  EXPECT_THAT(ids(result), Contains("row_offset"));
  expect_corrected(truth, result, 0.4);
}

// Row errors alone make a pair usable or bad.
TEST(InjectedFault, RowErrorsDetermineTheGrade) {
  const Rig truth = true_rig();
  const auto off_by = [&](double rows_px) {
    Rig rig = truth;
    rig.cameras[1].model = with_row_offset(rig.cameras[1].model, rows_px);
    return check(rig, simulate_matches(truth));
  };
  EXPECT_EQ(off_by(0.3).grade, PairGrade::good);
  EXPECT_EQ(off_by(0.7).grade, PairGrade::usable);
  const PairCheck bad = off_by(1.4);
  EXPECT_EQ(bad.grade, PairGrade::bad);
  EXPECT_LT(bad.nominal_rows.p95_px, 3) << "bad because of the mean";
}

TEST(InjectedFault, YawOfOneDegree) {
  for (const Rig& truth : {true_rig(), distortion_free_rig()}) {
    for (const double yaw_deg : {1.0, -1.0}) {
      PairCorrection off;
      off.yaw_rad = yaw_deg * kRadiansPerDegree;
      const PairCheck result =
          check(with_pose(truth, corrected_left_from_right(left_from_right(truth), off)), simulate_matches(truth));
      EXPECT_THAT(ids(result), ElementsAre("yaw_offset")) << yaw_deg;
      EXPECT_NEAR(result.correction.yaw_rad / kRadiansPerDegree, -yaw_deg, 0.1);
      EXPECT_NEAR(result.findings.at(0).value, -yaw_deg, 0.1);
      EXPECT_THAT(result.findings.at(0).text, HasSubstr(yaw_deg > 0 ? "further to the left" : "further to the right"));
      EXPECT_EQ(result.grade, PairGrade::bad);
      expect_corrected(truth, result);
    }
  }
}

// Half a degree may be lens decentering and is not corrected, except where distant points have negative disparities.
TEST(InjectedFault, YawOfHalfADegree) {
  const Rig truth = true_rig();
  const auto injected = [&](double yaw_deg) {
    PairCorrection off;
    off.yaw_rad = yaw_deg * kRadiansPerDegree;
    return check(with_pose(truth, corrected_left_from_right(left_from_right(truth), off)), simulate_matches(truth));
  };
  const PairCheck ambiguous = injected(-0.5);
  EXPECT_THAT(ids(ambiguous), ElementsAre("row_residuals"));
  EXPECT_THAT(ambiguous.findings.at(0).text, HasSubstr("rows do not distinguish the two"));
  EXPECT_EQ(ambiguous.grade, PairGrade::usable);
  const Pose apart = left_from_right(truth).inverse() * left_from_right(*ambiguous.corrected);
  EXPECT_NEAR(rotation_angle(apart) / kRadiansPerDegree, 0.5, 0.1);
  const PairCheck observable = injected(0.5);
  EXPECT_THAT(ids(observable), ElementsAre("yaw_offset"));
  EXPECT_THAT(observable.findings.at(0).text, HasSubstr("have negative disparity"));
  expect_corrected(truth, observable);
}

TEST(InjectedFault, DistortionIgnored) {
  Rig rig = true_rig();
  for (Camera& c : rig.cameras) c.model = std::get<RadialTangentialModel>(c.model).pinhole();
  const PairCheck result = check(rig, simulate_matches(true_rig()));
  EXPECT_THAT(ids(result), Contains("distortion_ignored"));
  EXPECT_EQ(result.grade, PairGrade::bad);
  EXPECT_LT(check(*result.corrected, simulate_matches(true_rig())).nominal_rows.mean_px,
            0.6 * result.nominal_rows.mean_px);
}

TEST(InjectedFault, FocalRatio) {
  const Rig truth = true_rig();
  Rig rig = truth;
  auto numbers = parameters(rig.cameras[1].model);
  for (double& f : numbers[0]) f *= 0.99;
  rig.cameras[1].model = with_parameters(rig.cameras[1].model, numbers);
  const PairCheck result = check(rig, simulate_matches(truth));
  EXPECT_THAT(ids(result), Contains("focal_ratio"));
  EXPECT_NEAR(result.correction.focal_ratio, 1 / 0.99, 0.001);
  EXPECT_THAT(result.findings.back().text, HasSubstr("% larger than the rig says"));
  expect_corrected(truth, result);
}

// An error of one camera that resembles other errors.
TEST(InjectedFault, FocalLengthOfAnotherSizeInOneCamera) {
  const Rig truth = true_rig();
  for (const double factor : {0.5, 1.5}) {
    Rig rig = truth;
    rig.cameras[1].model = with_scaled_focal_length(rig.cameras[1].model, factor);
    const PairCheck result = check(rig, simulate_matches(truth));
    EXPECT_THAT(ids(result), Contains("size_mismatch")) << factor;
    EXPECT_THAT(ids(result), Not(Contains("swapped_eyes"))) << factor;
    EXPECT_NEAR(result.correction.focal_ratio, 1 / factor, 0.005 / factor);
    EXPECT_THAT(result.findings.at(0).text, HasSubstr("of the right camera")) << factor;
    EXPECT_THAT(result.findings.at(0).text, Not(HasSubstr("do not distinguish"))) << factor;
    EXPECT_TRUE(result.has_gross_error);
    EXPECT_EQ(result.corrected->cameras[0].model, truth.cameras[0].model);
    expect_corrected(truth, result);
  }
}

// A factor closer to one than usual, which resembles an error of the lens.
TEST(InjectedFault, FocalLengthOfASimilarSizeInOneCamera) {
  const Rig truth = true_rig();
  Rig rig = truth;
  rig.cameras[1].model = with_scaled_focal_length(rig.cameras[1].model, 1.25);
  const PairCheck result = check(rig, simulate_matches(truth));
  EXPECT_THAT(ids(result), ElementsAre("size_mismatch", "focal_ratio"));
  EXPECT_NEAR(result.findings.at(0).value, 0.8, 0.005);
  expect_corrected(truth, result);
}

// A size error common to two pinholes does not change their rows; an implausible principal point reveals it.
TEST(InjectedFault, SizeOfTwoPinholes) {
  const Rig truth = distortion_free_rig();
  Rig rig = truth;
  for (Camera& c : rig.cameras) c.model = resized(c.model, 2);
  const PairCheck result = check(rig, simulate_matches(truth));
  EXPECT_THAT(ids(result), Each(std::string("size_mismatch")));
  EXPECT_NEAR(focal_px(*result.corrected), focal_px(truth), 1);
}

// With two equal pinholes the inverse factor on the other camera explains it equally well.
TEST(InjectedFault, FocalLengthOfAnotherSizeInOneOfTwoPinholes) {
  Rig truth = distortion_free_rig();
  truth.cameras[1].model = truth.cameras[0].model;
  truth = with_pose(truth, Pose::from_translation({0.11, 0, 0}));
  Rig rig = truth;
  rig.cameras[1].model = with_scaled_focal_length(rig.cameras[1].model, 2);
  const PairCheck result = check(rig, simulate_matches(truth));
  EXPECT_THAT(ids(result), Contains("size_mismatch"));
  EXPECT_THAT(result.findings.at(0).text, HasSubstr("of the left camera 2 times as large"));
  EXPECT_THAT(result.findings.at(0).text, HasSubstr("of the right camera 0.5 times as large"));
  EXPECT_THAT(result.findings.at(0).text, HasSubstr("rows do not distinguish the two"));
}

// Swapped images and a yaw: no size error must be reported.
TEST(InjectedFault, SwappedImagesAndYaw) {
  const Rig truth = distortion_free_rig();
  std::vector<PixelMatch> matches = simulate_matches(truth);
  for (PixelMatch& match : matches) std::swap(match.left, match.right);
  PairCorrection off;
  off.yaw_rad = kRadiansPerDegree;
  const PairCheck result = check(with_pose(truth, corrected_left_from_right(left_from_right(truth), off)), matches);
  EXPECT_THAT(ids(result), Contains("swapped_eyes"));
  EXPECT_THAT(ids(result), Not(Contains("size_mismatch")));
}

TEST(InjectedFault, FxAlone) {
  const Rig truth = true_rig();
  Rig rig = truth;
  for (Camera& c : rig.cameras) {
    auto numbers = parameters(c.model);
    numbers[0][0] *= 2;
    c.model = with_parameters(c.model, numbers);
  }
  const PairCheck result = check(rig, simulate_matches(truth));
  EXPECT_THAT(ids(result), Each(std::string("size_mismatch")));
  EXPECT_NEAR(focal_px(*result.corrected), focal_px(truth), 2);
  expect_corrected(truth, result);
}

// The images are right, the camera names swapped. An inverse transform would not explain the different camera models.
TEST(InjectedFault, SwappedCameraNames) {
  const Rig truth = true_rig();
  Rig rig = truth;
  std::swap(rig.pairs[0].left, rig.pairs[0].right);
  const PairCheck result = check(rig, simulate_matches(truth));
  EXPECT_THAT(ids(result), ElementsAre("swapped_eyes"));
  EXPECT_EQ(result.corrected->pairs[0].left, "left");
  expect_corrected(truth, result);
}

TEST(InjectedFault, SwappedIntrinsics) {
  const Rig truth = true_rig();
  Rig rig = truth;
  std::swap(rig.cameras[0].model, rig.cameras[1].model);
  const PairCheck result = check(rig, simulate_matches(truth));
  EXPECT_THAT(ids(result), ElementsAre("swapped_eyes"));
  EXPECT_EQ(result.corrected->cameras[0].model, truth.cameras[0].model);
  expect_corrected(truth, result);
}

// With two equal cameras an inverse transform and swapped names are equivalent; both are reported.
TEST(InjectedFault, EqualCamerasOnTheWrongSide) {
  Rig truth = distortion_free_rig();
  truth.cameras[1].model = truth.cameras[0].model;
  truth = with_pose(truth, Pose::from_translation({0.11, 0, 0}));
  const PairCheck result = check(with_pose(truth, Pose::from_translation({-0.11, 0, 0})), simulate_matches(truth));
  EXPECT_THAT(ids(result), ElementsAre("inverse_transform", "swapped_eyes"));
  expect_corrected(truth, result);
}

TEST(InjectedFault, DistortionIgnoredInOneCamera) {
  const Rig truth = true_rig();
  Rig rig = truth;
  rig.cameras[1].model = std::get<RadialTangentialModel>(truth.cameras[1].model).pinhole();
  const PairCheck result = check(rig, simulate_matches(truth));
  EXPECT_THAT(ids(result), Contains("distortion_ignored"));
  EXPECT_THAT(ids(result), Not(Contains("size_mismatch")));
  EXPECT_EQ(result.corrected->cameras[0].model, truth.cameras[0].model);
  EXPECT_LT(check(*result.corrected, simulate_matches(truth, 700, 2)).nominal_rows.mean_px, 0.3);
}

TEST(InjectedFault, RollOfOneDegree) {
  const Rig truth = true_rig();
  PairCorrection off;
  off.roll_rad = kRadiansPerDegree;
  const PairCheck result =
      check(with_pose(truth, corrected_left_from_right(left_from_right(truth), off)), simulate_matches(truth));
  EXPECT_THAT(ids(result), ElementsAre("roll_offset"));
  EXPECT_NEAR(result.findings.at(0).value, -1, 0.05);
  EXPECT_EQ(result.grade, PairGrade::bad);
  expect_corrected(truth, result);
}

TEST(InjectedFault, BaselineDirection) {
  const Rig truth = true_rig();
  Pose pose = left_from_right(truth);
  pose = Pose(pose.rotation(), pose.translation() + Eigen::Vector3d(0, 0.01, 0.01));
  const PairCheck result = check(with_pose(truth, pose), simulate_matches(truth));
  EXPECT_NE(result.grade, PairGrade::good);
  expect_corrected(truth, result);
}

// A rotation of 180° is not a calibration error: no correction is made.
TEST(InjectedFault, CameraUpsideDown) {
  const Rig truth = true_rig();
  PairCorrection off;
  off.roll_rad = 180 * kRadiansPerDegree;
  const Rig rig = with_pose(truth, corrected_left_from_right(left_from_right(truth), off));
  const PairCheck result = check(rig, simulate_matches(truth));
  EXPECT_EQ(result.grade, PairGrade::bad);
  EXPECT_TRUE(!result.corrected || *result.corrected == rig);
}

// Focal lengths in millimetres instead of pixels: a corrected rig must have a plausible focal length.
TEST(InjectedFault, FocalLengthsInMillimetres) {
  const Rig truth = true_rig();
  Rig rig = truth;
  for (Camera& c : rig.cameras) c.model = with_scaled_focal_length(c.model, 3 / focal_px(truth));
  const PairCheck result = check(rig, simulate_matches(truth));
  EXPECT_EQ(result.grade, PairGrade::bad);
  EXPECT_THAT(ids(result), Contains("size_mismatch"));
  if (result.corrected) {
    EXPECT_GE(focal_px(*result.corrected), 3);
  }
}

// Images of different times or rigs: no specific error is reported and no corrected rig is made.
TEST(InjectedFault, UnrelatedImages) {
  std::vector<PixelMatch> matches = simulate_matches(true_rig());
  Random random(5);
  for (PixelMatch& match : matches) match.right.y() += random.uniform(-60, 60);
  const PairCheck result = check(true_rig(), matches);
  EXPECT_THAT(ids(result), ElementsAre(AnyOf("not_explained", "not_enough_texture")));
  EXPECT_EQ(result.grade, PairGrade::bad);
  EXPECT_TRUE(std::isnan(result.correction.yaw_rad) && std::isnan(result.corrected_rows.mean_px));
}

TEST(InjectedFault, SameImageTwice) {
  std::vector<PixelMatch> matches = simulate_matches(distortion_free_rig());
  for (PixelMatch& match : matches) match.right = match.left;
  EXPECT_THAT(ids(check(distortion_free_rig(), matches)), ElementsAre("identical_images"));
}

// A correct rig is returned unchanged: corrections within their uncertainty would degrade range.
TEST(InjectedFault, CorrectRigIsUnchanged) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Rig truth = true_rig();
    EXPECT_EQ(*check(truth, simulate_matches(truth, 300, seed)).corrected, truth) << seed;
  }
}

}  // namespace
}  // namespace spartan
