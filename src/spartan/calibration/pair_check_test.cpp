#include "spartan/calibration/pair_check.h"

#include <algorithm>

#include "spartan/calibration/internal/model_modification.h"
#include "spartan/calibration/internal/pair_refinement.h"
#include "spartan/calibration/internal/simulated_pair_matches_test.h"
#include "spartan/core/pose.h"

namespace spartan {

using namespace internal;

namespace {

using testing::check;
using ::testing::Contains;
using testing::distortion_free_rig;
using ::testing::ElementsAre;
using testing::expect_corrected;
using testing::ids;
using ::testing::IsEmpty;
using testing::kSize;
using testing::left_from_right;
using testing::simulate_matches;
using testing::true_rig;
using testing::with_pose;

TEST(PairCheck, CorrectRigsAreGood) {
  for (const Rig& rig : {true_rig(), distortion_free_rig()}) {
    const PairCheck result = check(rig, simulate_matches(rig));
    EXPECT_THAT(ids(result), IsEmpty());
    EXPECT_EQ(result.grade, PairGrade::good);
    EXPECT_NEAR(result.nominal_rows.mean_px, 0.12, 0.03);  // 0.15 √(2/π)
    EXPECT_NEAR(result.nominal_rows.p95_px, 0.30, 0.1);
    EXPECT_NEAR(result.unrectified_rows.median_px, 248.4 - 255.2, 4) << "the right principal point is lower";
    EXPECT_GE(result.inliers, 600);
    EXPECT_LE(result.inliers, 660);
    expect_corrected(rig, result);
  }
}

// Errors of the estimates agree with their standard deviations (normalized estimation error squared).
TEST(PairCheck, CorrectionsAreConsistentWithTheirSigma) {
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
    // The nominal rig needs this correction to become the true one.
    Pose nominal = left_from_right(truth);
    const Eigen::Quaterniond rotation = corrected_left_from_right(Pose(), wanted).rotation();
    nominal = Pose(nominal.rotation() * rotation.conjugate(), nominal.translation());
    Rig rig = with_pose(truth, nominal);
    auto numbers = parameters(rig.cameras[1].model);
    for (double& f : numbers[0]) f /= wanted.focal_ratio;
    rig.cameras[1].model = with_parameters(rig.cameras[1].model, numbers);
    const PairFit fit = fit_pair(rig.cameras[0].model, rig.cameras[1].model, left_from_right(rig),
                                 simulate_matches(truth, 700, static_cast<std::uint64_t>(trial)));
    const Eigen::Vector4d error((fit.correction.pitch_rad - wanted.pitch_rad) / fit.sigma.pitch_rad,
                                (fit.correction.roll_rad - wanted.roll_rad) / fit.sigma.roll_rad,
                                (fit.correction.yaw_rad - wanted.yaw_rad) / fit.sigma.yaw_rad,
                                (fit.correction.focal_ratio - wanted.focal_ratio) / fit.sigma.focal_ratio);
    square += error.cwiseAbs2();
  }
  // Mean normalized squares of 40 trials: expected 1 ± 0.22.
  for (int k = 0; k < 4; ++k) EXPECT_NEAR(square[k] / kTrials, 1, 0.7) << k;
}

// x right, y down, z ahead.
TEST(PairCheck, SignsOfCorrections) {
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

TEST(PairCheck, ReportsTooFewMatches) {
  const Rig truth = true_rig();
  const PairCheck few = check(truth, simulate_matches(truth, 30));
  EXPECT_THAT(ids(few), ElementsAre("not_enough_texture"));
  EXPECT_EQ(few.grade, PairGrade::bad);
  EXPECT_TRUE(std::isnan(few.correction.yaw_rad) && std::isnan(few.nominal_rows.mean_px)) << "unknown values are NaN";
  EXPECT_EQ(*few.corrected, truth);
  EXPECT_THAT(ids(check(truth, {})), ElementsAre("not_enough_texture"));
  // Many matches, all in one corner.
  std::vector<PixelMatch> corner = simulate_matches(truth, 4000);
  std::erase_if(corner, [](const PixelMatch& m) { return m.left.x() > 180 || m.left.y() > 160; });
  EXPECT_THAT(ids(check(truth, corner)), ElementsAre("not_enough_texture"));
}

// Distant points only (60 m and more): a yaw within its uncertainty makes most disparities negative, which must not be
// taken for swapped cameras.
TEST(PairCheck, DistantScenesDoNotRevealSwappedCameras) {
  const Rig truth = true_rig();
  Random random(1);
  std::vector<PixelMatch> far;
  while (far.size() < 600) {
    const Eigen::Vector2d pixel(random.uniform(0, kSize.width - 1), random.uniform(0, kSize.height - 1));
    const auto ray = unproject(truth.cameras[0].model, pixel);
    if (!ray) continue;
    const double depth = std::exp(random.uniform(std::log(60.0), std::log(1000.0)));
    const auto seen = project(truth.cameras[1].model, truth.right_from_left(truth.pairs[0]) * (depth * ray->direction));
    if (seen) far.push_back({pixel, *seen + 0.15 * Eigen::Vector2d(random.normal(), random.normal())});
  }
  for (const double yaw_deg : {0.0, 0.05, 0.1}) {
    PairCorrection off;
    off.yaw_rad = yaw_deg * kRadiansPerDegree;
    const PairCheck result = check(with_pose(truth, corrected_left_from_right(left_from_right(truth), off)), far);
    EXPECT_THAT(ids(result), IsEmpty()) << yaw_deg;
  }
}

// To either side of each limit of check_pair(). Row errors are added where a finding appears only with bad rows.
TEST(PairCheck, FindingsAppearAtTheirLimits) {
  const Rig truth = true_rig();
  const auto with = [&](const PairCorrection& off, double rows_px) {
    Rig rig = with_pose(truth, corrected_left_from_right(left_from_right(truth), off));
    rig.cameras[1].model = with_row_offset(with_scaled_focal_length(rig.cameras[1].model, off.focal_ratio), rows_px);
    return ids(check(rig, simulate_matches(truth, 1500)));
  };
  EXPECT_THAT(with({}, 0.4), IsEmpty());
  EXPECT_THAT(with({}, 0.5), ElementsAre("row_offset")) << "0.57 px after undistortion";
  EXPECT_THAT(with({.roll_rad = 0.05 * kRadiansPerDegree}, 0.8), ElementsAre("row_offset")) << "0.33 px at the sides";
  EXPECT_THAT(with({.roll_rad = 0.10 * kRadiansPerDegree}, 0.8), ElementsAre("row_offset", "roll_offset")) << "0.66 px";
  EXPECT_THAT(with({.focal_ratio = 1.0022}, 0), IsEmpty());
  EXPECT_THAT(with({.focal_ratio = 1.0040}, 0), ElementsAre("focal_ratio"));
  EXPECT_THAT(with({.yaw_rad = -0.75 * kRadiansPerDegree}, 0), ElementsAre("row_residuals"))
      << "may be lens decentering";
  EXPECT_THAT(with({.yaw_rad = -0.95 * kRadiansPerDegree}, 0), ElementsAre("yaw_offset"));
}

// Small distortion is not reported for a pinhole.
TEST(PairCheck, DistortionIsReportedWhereSignificant) {
  for (const double k1 : {-0.015, -0.04}) {
    Rig truth = distortion_free_rig();
    truth.cameras[1].model = RadialTangentialModel({457.6, 456.1, 379.9, 255.2}, {k1, 0});
    const std::vector<std::string> found = ids(check(distortion_free_rig(), simulate_matches(truth, 1500)));
    EXPECT_EQ(std::count(found.begin(), found.end(), "distortion_ignored"), k1 < -0.02 ? 1 : 0) << k1;
  }
}

TEST(PairCheck, WorksWithoutACalibration) {
  const PairCheck result = check_images(simulate_matches(distortion_free_rig()), kSize);
  EXPECT_THAT(ids(result), ::testing::Not(Contains("inverse_transform")));
  EXPECT_NEAR(result.correction.roll_rad, 0.003, 0.001);
  EXPECT_LT(result.corrected_rows.mean_px, 0.2);
}

}  // namespace
}  // namespace spartan
