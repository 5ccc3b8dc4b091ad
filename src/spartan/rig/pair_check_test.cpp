#include "spartan/rig/pair_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "spartan/core/random.h"
#include "spartan/rig/model_changes.h"

namespace spartan {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kDegree = std::numbers::pi / 180;
constexpr ImageSize kSize{752, 480};

Camera camera(const std::string& name, const CameraModel& model) {
  Camera made;
  made.name = name;
  made.size = kSize;
  made.model = model;
  return made;
}

// Two lenses that bend, a baseline of 11 cm, eyes a little turned to each other.
Rig true_rig() {
  const Pose left_from_right(exp_so3({0.004, -0.006, 0.003}), {0.11, 0.001, -0.0005});
  return rig_of_one_pair(
      "true", camera("left", RadialTangentialModel({458.6, 457.3, 367.2, 248.4}, {-0.283, 0.074, 2e-4, 2e-5})),
      camera("right", RadialTangentialModel({457.6, 456.1, 379.9, 255.2}, {-0.284, 0.0745, -1e-4, -3e-5})),
      left_from_right.inverse());
}

// The same without distortion.
Rig straight_rig() {
  Rig rig = true_rig();
  for (Camera& c : rig.cameras) c.model = std::get<RadialTangentialModel>(c.model).pinhole();
  return rig;
}

// What the rig's eyes see of points on the ground, on walls and far away, found to 0.15 px; one in twelve matches is
// wrong.
std::vector<PixelMatch> look(const Rig& rig, int count = 700, std::uint64_t seed = 1) {
  Random random(seed);
  const StereoPair& pair = rig.pairs.front();
  const Camera &left = *rig.find_camera(pair.left), &right = *rig.find_camera(pair.right);
  const Pose right_from_left = rig.right_from_left(pair);
  std::vector<PixelMatch> matches;
  while (std::ssize(matches) < count) {
    const Eigen::Vector2d pixel(random.uniform(0, kSize.width - 1), random.uniform(0, kSize.height - 1));
    const auto ray = unproject(left.model, pixel);
    if (!ray) continue;
    // Below the horizon the ground 1 m below the eyes, above it walls from 3 m away to the far hills.
    const double depth = ray->direction.y() > 0.08 ? 1 / ray->direction.y() : std::exp(random.uniform(1, 6));
    const auto seen = project(right.model, right_from_left * (depth * ray->direction));
    if (!seen || seen->x() < 0 || seen->x() > kSize.width - 1 || seen->y() < 0 || seen->y() > kSize.height - 1)
      continue;
    Eigen::Vector2d found = *seen + 0.15 * Eigen::Vector2d(random.normal(), random.normal());
    if (random.uniform(0, 12) < 1) found = {random.uniform(0, kSize.width - 1), random.uniform(0, kSize.height - 1)};
    matches.push_back({pixel, found});
  }
  return matches;
}

PairCheck check(const Rig& believed, const std::vector<PixelMatch>& matches) {
  return check_pair(believed, believed.pairs.front(), matches, kSize);
}

std::vector<std::string> ids(const PairCheck& result) {
  std::vector<std::string> names;
  names.reserve(result.findings.size());
  for (const RigFinding& finding : result.findings) names.push_back(finding.id);
  return names;
}

// The rig with left_from_right changed.
Rig with_pose(Rig rig, const Pose& left_from_right) {
  rig.cameras[1].mount_from_camera = rig.cameras[0].mount_from_camera * left_from_right;
  return rig;
}
Pose left_from_right(const Rig& rig) {
  return rig.right_from_left(rig.pairs.front()).inverse();
}

// What --apply writes must be good, and see the world as the true rig does.
void expect_mended(const Rig& truth, const PairCheck& result, double angle_deg = 0.15) {
  const auto again = check(*result.corrected, look(truth, 700, 2));
  EXPECT_THAT(ids(again), IsEmpty());
  EXPECT_EQ(again.verdict, PairVerdict::good);
  const Pose apart = left_from_right(truth).inverse() * left_from_right(*result.corrected);
  EXPECT_LE(rotation_angle(apart) / kDegree, angle_deg);
}

TEST(PairCheck, SoundRigsAreGood) {
  for (const Rig& rig : {true_rig(), straight_rig()}) {
    const PairCheck result = check(rig, look(rig));
    EXPECT_THAT(ids(result), IsEmpty());
    EXPECT_EQ(result.verdict, PairVerdict::good);
    EXPECT_NEAR(result.as_given.mean_px, 0.12, 0.03);  // 0.15 √(2/π)
    EXPECT_NEAR(result.as_given.p95_px, 0.30, 0.1);
    EXPECT_NEAR(result.as_taken.median_px, 248.4 - 255.2, 4) << "the right principal point lies lower";
    EXPECT_GE(result.inliers, 600);
    EXPECT_LE(result.inliers, 660);
    expect_mended(rig, result);
  }
}

// The errors are found to what is said about them.
TEST(PairCheck, CorrectionsAreThoseOfTheWorld) {
  const Rig truth = true_rig();
  Eigen::Vector4d square = Eigen::Vector4d::Zero();
  constexpr int kTrials = 40;
  for (int trial = 0; trial < kTrials; ++trial) {
    Random random(100 + static_cast<std::uint64_t>(trial));
    PairCorrection wanted;
    wanted.pitch_rad = 0.01 * random.normal();
    wanted.roll_rad = 0.01 * random.normal();
    wanted.yaw_rad = 0.005 * random.normal();
    wanted.focal_ratio = 1 + 0.01 * random.normal();
    // The believed rig is the true one before the correction.
    Pose believed = left_from_right(truth);
    const Eigen::Quaterniond turn = corrected_left_from_right(Pose(), wanted).rotation();
    believed = Pose(believed.rotation() * turn.conjugate(), believed.translation());
    Rig rig = with_pose(truth, believed);
    auto numbers = parameters(rig.cameras[1].model);
    for (double& f : numbers[0]) f /= wanted.focal_ratio;
    rig.cameras[1].model = with_parameters(rig.cameras[1].model, numbers);
    const PairFit fit = fit_pair(rig.cameras[0].model, rig.cameras[1].model, left_from_right(rig),
                                 look(truth, 700, static_cast<std::uint64_t>(trial)));
    const Eigen::Vector4d error((fit.correction.pitch_rad - wanted.pitch_rad) / fit.sigma.pitch_rad,
                                (fit.correction.roll_rad - wanted.roll_rad) / fit.sigma.roll_rad,
                                (fit.correction.yaw_rad - wanted.yaw_rad) / fit.sigma.yaw_rad,
                                (fit.correction.focal_ratio - wanted.focal_ratio) / fit.sigma.focal_ratio);
    square += error.cwiseAbs2();
  }
  // Mean normalized squares of 40 trials: 1 ± 0.22.
  for (int k = 0; k < 4; ++k) EXPECT_NEAR(square[k] / kTrials, 1, 0.7) << k;
}

// x right, y down, z ahead.
TEST(PairCheck, TurnsAndSwingsAreThoseSaid) {
  const auto corrected = [](const PairCorrection& c) {
    return corrected_left_from_right(Pose::from_translation({1, 0, 0}), c);
  };
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), z = Eigen::Vector3d::UnitZ();
  EXPECT_LT((corrected({.pitch_rad = 0.01}).rotation() * z).y(), -0.009) << "up";
  EXPECT_GT((corrected({.yaw_rad = 0.01}).rotation() * z).x(), 0.009) << "to the right";
  EXPECT_GT((corrected({.roll_rad = 0.01}).rotation() * x).y(), 0.009) << "clockwise";
  const Eigen::Vector3d swung = corrected({.baseline_down_rad = 0.01, .baseline_ahead_rad = 0.02}).translation();
  EXPECT_LT((swung - Eigen::Vector3d(1, 0.01, 0.02)).norm(), 1e-3);
  EXPECT_NEAR(swung.norm(), 1, 1e-12);
}

// --- faults that people plant in calibrations, each known by its name ---

TEST(PlantedFault, InverseTransform) {
  const Rig truth = true_rig();
  const PairCheck result = check(with_pose(truth, left_from_right(truth).inverse()), look(truth));
  EXPECT_THAT(ids(result), ElementsAre("inverse_transform"));
  EXPECT_EQ(result.verdict, PairVerdict::bad);
  expect_mended(truth, result);
}

TEST(PlantedFault, SwappedPictures) {
  const Rig truth = true_rig();
  std::vector<PixelMatch> matches = look(truth);
  for (PixelMatch& match : matches) std::swap(match.left, match.right);
  const PairCheck result = check(truth, matches);
  EXPECT_THAT(ids(result), ElementsAre("swapped_eyes"));
  EXPECT_EQ(result.verdict, PairVerdict::bad);
  expect_mended(truth, result);
}

TEST(PlantedFault, SwappedEyesOfTheRig) {
  const Rig truth = true_rig();
  Rig rig = truth;
  std::swap(rig.pairs[0].left, rig.pairs[0].right);
  std::vector<PixelMatch> matches = look(truth);
  for (PixelMatch& match : matches) std::swap(match.left, match.right);
  const PairCheck result = check(rig, matches);
  EXPECT_THAT(ids(result), ElementsAre("swapped_eyes"));
  EXPECT_EQ(result.corrected->pairs[0].left, "left");
  expect_mended(truth, result);
}

// In millimetres, in centimetres, in metres that were taken for millimetres.
TEST(PlantedFault, BaselineInOtherUnits) {
  const Rig truth = true_rig();
  const Pose pose = left_from_right(truth);
  for (const double factor : {1000.0, 100.0, 0.001}) {
    const PairCheck result = check(with_pose(truth, {pose.rotation(), factor * pose.translation()}), look(truth));
    EXPECT_THAT(ids(result), ElementsAre("baseline_unit")) << factor;
    EXPECT_EQ(result.verdict, PairVerdict::bad);
    EXPECT_NEAR(left_from_right(*result.corrected).translation().norm(), 0.11, 0.001) << factor;
    expect_mended(truth, result);
  }
}

TEST(PlantedFault, EyesApart) {
  const Rig truth = true_rig();
  const PairCheck result = check(with_pose(truth, Pose(exp_so3({0, 20 * kDegree, 0}), {0.11, 0, 0})), {});
  EXPECT_THAT(ids(result), ElementsAre("eyes_apart", "not_enough_texture"));
  EXPECT_EQ(result.verdict, PairVerdict::bad);
}

// The calibration of pictures twice as large: centre and focal length, or the focal length alone.
TEST(PlantedFault, FocalLengthOfAnotherSize) {
  const Rig truth = true_rig();
  for (const bool centre_too : {true, false}) {
    Rig rig = truth;
    for (Camera& c : rig.cameras) {
      auto numbers = parameters(c.model);
      for (double& f : numbers[0]) f *= 2;
      if (centre_too) {
        for (double& v : numbers[1]) v = (v + 0.5) * 2 - 0.5;
      }
      c.model = with_parameters(c.model, numbers);
    }
    const PairCheck result = check(rig, look(truth));
    EXPECT_THAT(ids(result), Contains("size_mismatch")) << centre_too;
    EXPECT_EQ(result.verdict, PairVerdict::bad);
    expect_mended(truth, result, 0.3);
  }
}

TEST(PlantedFault, PicturesOfAnotherSize) {
  const Rig truth = true_rig();
  const auto halved = [](std::vector<PixelMatch> matches) {
    for (PixelMatch& m : matches) {
      for (Eigen::Vector2d* p : {&m.left, &m.right}) *p = ((p->array() + 0.5) / 2 - 0.5).matrix();
    }
    return matches;
  };
  const ImageSize half{376, 240};
  const PairCheck result = check_pair(truth, truth.pairs[0], halved(look(truth)), half);
  EXPECT_THAT(ids(result), ElementsAre("size_mismatch", "size_mismatch")) << "both cameras";
  EXPECT_EQ(result.verdict, PairVerdict::bad);
  const PairCheck again = check_pair(*result.corrected, result.corrected->pairs[0], halved(look(truth, 700, 2)), half);
  EXPECT_THAT(ids(again), IsEmpty());
  EXPECT_EQ(again.verdict, PairVerdict::good);
}

// Of the right eye only: the left one's numbers are sound.
TEST(PlantedFault, OneCalibrationOfAnotherSize) {
  const Rig truth = true_rig();
  Rig rig = truth;
  rig.cameras[1].model = resized(rig.cameras[1].model, 0.5);
  rig.cameras[1].size = {376, 240};
  const PairCheck result = check(rig, look(truth));
  EXPECT_THAT(ids(result), ElementsAre("size_mismatch"));
  EXPECT_EQ(result.corrected->cameras[0].model, truth.cameras[0].model);
  expect_mended(truth, result);
}

// A focal length that is none (millimetres), or one of its two numbers: the view in degrees and fx/fy are no factors.
TEST(PlantedFault, FocalLengthsThatCannotBe) {
  const Rig truth = straight_rig();
  for (const PinholeModel& odd : {PinholeModel{3, 3, 367.2, 248.4}, PinholeModel{458, 229, 367.2, 248.4}}) {
    Rig rig = truth;
    rig.cameras[0].model = odd;
    const PairCheck result = check(rig, look(truth));
    EXPECT_THAT(ids(result), Contains("size_mismatch"));
    EXPECT_EQ(result.verdict, PairVerdict::bad);
    const auto seen_ahead = [](const Rig& r) { return *project(r.cameras[0].model, Eigen::Vector3d::UnitZ()); };
    EXPECT_EQ(seen_ahead(*result.corrected), seen_ahead(rig)) << "the picture is no larger";
  }
}

TEST(PlantedFault, RowsOffByTwoPixels) {
  const Rig truth = true_rig();
  Rig rig = truth;
  auto numbers = parameters(rig.cameras[1].model);
  numbers[1][1] += 2;
  rig.cameras[1].model = with_parameters(rig.cameras[1].model, numbers);
  const PairCheck result = check(rig, look(truth));
  EXPECT_THAT(ids(result), ElementsAre("row_offset"));
  EXPECT_NEAR(result.as_given.median_px, 2, 0.5);  // a little more where the lens is straightened
  EXPECT_THAT(result.findings.at(0).text, HasSubstr("px below those of the right one"));
  EXPECT_EQ(result.verdict, PairVerdict::bad);
  expect_mended(truth, result, 0.4);  // two rows are 0.25°
}

// Rows alone make a pair usable or bad.
TEST(PlantedFault, RowsDecideTheVerdict) {
  const Rig truth = true_rig();
  const auto off_by = [&](double rows_px) {
    Rig rig = truth;
    auto numbers = parameters(rig.cameras[1].model);
    numbers[1][1] += rows_px;
    rig.cameras[1].model = with_parameters(rig.cameras[1].model, numbers);
    return check(rig, look(truth));
  };
  EXPECT_EQ(off_by(0.3).verdict, PairVerdict::good);
  EXPECT_EQ(off_by(0.7).verdict, PairVerdict::usable);
  const PairCheck bad = off_by(1.4);
  EXPECT_EQ(bad.verdict, PairVerdict::bad);
  EXPECT_LT(bad.as_given.p95_px, 3) << "by the mean";
}

TEST(PlantedFault, YawOfADegree) {
  for (const Rig& truth : {true_rig(), straight_rig()}) {
    for (const double yaw_deg : {1.0, -1.0}) {
      PairCorrection off;
      off.yaw_rad = yaw_deg * kDegree;
      const PairCheck result =
          check(with_pose(truth, corrected_left_from_right(left_from_right(truth), off)), look(truth));
      EXPECT_THAT(ids(result), ElementsAre("yaw_offset")) << yaw_deg;
      EXPECT_NEAR(result.correction.yaw_rad / kDegree, -yaw_deg, 0.1);
      EXPECT_NEAR(result.findings.at(0).value, -yaw_deg, 0.1);
      EXPECT_THAT(result.findings.at(0).text, HasSubstr(yaw_deg > 0 ? "further to the left" : "further to the right"));
      EXPECT_EQ(result.verdict, PairVerdict::bad);
      expect_mended(truth, result);
    }
  }
}

// Half a degree may be the lens's, and stays; but not where the far hills would be beyond infinity.
TEST(PlantedFault, YawOfHalfADegree) {
  const Rig truth = true_rig();
  const auto planted = [&](double yaw_deg) {
    PairCorrection off;
    off.yaw_rad = yaw_deg * kDegree;
    return check(with_pose(truth, corrected_left_from_right(left_from_right(truth), off)), look(truth));
  };
  const PairCheck stays = planted(-0.5);
  EXPECT_THAT(ids(stays), ElementsAre("rows_apart"));
  EXPECT_THAT(stays.findings.at(0).text, HasSubstr("rows do not tell which"));
  EXPECT_EQ(stays.verdict, PairVerdict::usable);
  const Pose apart = left_from_right(truth).inverse() * left_from_right(*stays.corrected);
  EXPECT_NEAR(rotation_angle(apart) / kDegree, 0.5, 0.1);
  const PairCheck told = planted(0.5);
  EXPECT_THAT(ids(told), ElementsAre("yaw_offset"));
  EXPECT_THAT(told.findings.at(0).text, HasSubstr("beyond infinity"));
  expect_mended(truth, told);
}

TEST(PlantedFault, DistortionIgnored) {
  Rig rig = true_rig();
  for (Camera& c : rig.cameras) c.model = std::get<RadialTangentialModel>(c.model).pinhole();
  const PairCheck result = check(rig, look(true_rig()));
  EXPECT_THAT(ids(result), Contains("distortion_ignored"));
  EXPECT_EQ(result.verdict, PairVerdict::bad);
  EXPECT_LT(check(*result.corrected, look(true_rig())).as_given.mean_px, 0.6 * result.as_given.mean_px);
}

TEST(PlantedFault, FocalRatio) {
  const Rig truth = true_rig();
  Rig rig = truth;
  auto numbers = parameters(rig.cameras[1].model);
  for (double& f : numbers[0]) f *= 0.99;
  rig.cameras[1].model = with_parameters(rig.cameras[1].model, numbers);
  const PairCheck result = check(rig, look(truth));
  EXPECT_THAT(ids(result), Contains("focal_ratio"));
  EXPECT_NEAR(result.correction.focal_ratio, 1 / 0.99, 0.001);
  EXPECT_THAT(result.findings.back().text, HasSubstr("% larger than the rig says"));
  expect_mended(truth, result);
}

TEST(PairCheck, SaysWhenThereIsTooLittleToSee) {
  const Rig truth = true_rig();
  const PairCheck few = check(truth, look(truth, 30));
  EXPECT_THAT(ids(few), ElementsAre("not_enough_texture"));
  EXPECT_EQ(few.verdict, PairVerdict::bad);
  EXPECT_TRUE(std::isnan(few.correction.yaw_rad) && std::isnan(few.as_given.mean_px)) << "no figure is made up";
  EXPECT_EQ(*few.corrected, truth);
  EXPECT_THAT(ids(check(truth, {})), ElementsAre("not_enough_texture"));
  // Many, but in one corner.
  std::vector<PixelMatch> corner = look(truth, 4000);
  std::erase_if(corner, [](const PixelMatch& m) { return m.left.x() > 180 || m.left.y() > 160; });
  EXPECT_THAT(ids(check(truth, corner)), ElementsAre("not_enough_texture"));
}

TEST(PairCheck, WithoutACalibrationThePicturesSpeak) {
  const PairCheck result = check_pictures(look(straight_rig()), kSize);
  EXPECT_THAT(ids(result), ::testing::Not(Contains("inverse_transform")));
  EXPECT_NEAR(result.correction.roll_rad, 0.003, 0.001);
  EXPECT_LT(result.as_corrected.mean_px, 0.2);
}

}  // namespace
}  // namespace spartan
