#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "spartan/localization/internal/drive_test.h"
#include "spartan/localization/localizer.h"
#include "spartan/testing/text_checks.h"

namespace spartan {

using namespace internal;

namespace {

// The filter of the same model, with nothing to correct it, is the oracle.
TEST(DeadReckoning, HasTheCovarianceOfAVisionOnlyFilter) {
  const TestDrive drive;
  const LocalizationOptions options;  // with errors that last
  VisionOnlyFilter track = VisionOnlyFilter::create(options).value();
  track.start(test_stamp(2.5), Pose());
  DeadReckoning reckoned = DeadReckoning::create(options.vision).value();
  int compared = 0;
  for (const Measurement& m : test_motions(drive, 122.5, 1, 5)) {
    const auto& motion = std::get<RelativeMotion>(m);
    ASSERT_TRUE(track.add(motion));
    reckoned.add(motion);
    const Matrix6d wanted = track.world_from_body().covariance, found = reckoned.covariance();
    for (int i = 0; i < 6; ++i) EXPECT_NEAR(found(i, i), wanted(i, i), 0.03 * wanted(i, i) + 1e-11) << i;
    ++compared;
  }
  EXPECT_EQ(compared, 80);
}

TEST(DeadReckoning, ComposesIndependentErrors) {
  const TestDrive drive;
  VisionOptions white;
  white.white_noise_factor = 1;
  white.drift_sigma_ratios = white.constant_sigma_ratios = {0, 0, 0, 0, 0, 0};
  DeadReckoning reckoned = DeadReckoning::create(white).value();
  UncertainPose composed;
  for (const Measurement& m : test_motions(drive, 62.5, 1, 6)) {
    const auto& motion = std::get<RelativeMotion>(m);
    reckoned.add(motion);
    composed = compose(composed, {motion.previous_from_current, motion.covariance});
  }
  EXPECT_TRUE(reckoned.covariance().isApprox(composed.covariance, 1e-9));
}

TEST(DeadReckoning, LastingErrorsHaveNoPartWhereTheRoverIsStationaryOrVisionIsLost) {
  VisionOptions vision;
  vision.white_noise_factor = 1;
  for (const bool measured : {true, false}) {
    RelativeMotion motion;
    motion.covariance = test_motion_covariance();
    motion.measured = measured;
    if (!measured) motion.previous_from_current = Pose::from_translation({0.1, 0, 0});
    DeadReckoning reckoned = DeadReckoning::create(vision).value();
    reckoned.add(motion);
    EXPECT_TRUE(reckoned.covariance().isApprox(motion.covariance, 1e-12)) << measured;
  }
}

// A motion over a lost frame, from the frame before it: the lost motion has no part in it.
TEST(DeadReckoning, ALostMotionThatKeepsItsReferenceCostsNothing) {
  RelativeMotion before, lost, after;
  before.from = test_stamp(0);
  before.to = lost.from = after.from = test_stamp(1);
  lost.to = test_stamp(2);
  after.to = test_stamp(3);
  before.covariance = after.covariance = test_motion_covariance();
  lost.covariance = Matrix6d::Identity();
  lost.measured = false;
  lost.keeps_reference = true;
  const VisionOptions options;
  DeadReckoning with = DeadReckoning::create(options).value(), without = with, from_lost = with;
  for (DeadReckoning* each : {&with, &without, &from_lost}) each->add(before);
  with.add(lost);
  EXPECT_GT(with.covariance().diagonal().minCoeff(), 0.9);
  with.add(after);
  without.add(after);
  EXPECT_TRUE(with.covariance().isApprox(without.covariance(), 1e-12));
  // A motion from the lost frame adds to its uncertainty.
  from_lost.add(lost);
  after.from = lost.to;
  from_lost.add(after);
  EXPECT_GT(from_lost.covariance().diagonal().minCoeff(), 0.9);
}

// A turned mount moves the rover to one side, the more the farther it drives; on the way back it moves it back.
TEST(DeadReckoning, ErrorsOfTheCalibrationAreTheSameInAllMotions) {
  VisionOptions vision;
  vision.drift_sigma_ratios = vision.constant_sigma_ratios = {0, 0, 0, 0, 0, 0};
  DeadReckoning reckoned = DeadReckoning::create(vision).value();
  RelativeMotion ahead, back;
  ahead.previous_from_current = Pose::from_translation({0.1, 0, 0});
  ahead.by_calibration(1, 5) = 0.1 * 0.003;
  ahead.covariance = ahead.by_calibration * ahead.by_calibration.transpose();
  back.previous_from_current = ahead.previous_from_current.inverse();
  back.by_calibration = -ahead.by_calibration;
  back.covariance = ahead.covariance;
  std::int64_t second = 0;
  const auto add = [&](RelativeMotion motion) {
    motion.from = test_stamp(static_cast<double>(second));
    motion.to = test_stamp(static_cast<double>(++second));
    reckoned.add(motion);
  };
  for (int i = 0; i < 50; ++i) add(ahead);
  EXPECT_NEAR(std::sqrt(reckoned.covariance()(1, 1)), 5 * 0.003, 1e-9);
  for (int i = 0; i < 50; ++i) add(back);
  EXPECT_NEAR(reckoned.covariance()(1, 1), 0, 1e-15);
}

TEST(DeadReckoning, GoesOnFromRestoredMemory) {
  const TestDrive drive;
  const VisionOptions options;
  DeadReckoning straight = DeadReckoning::create(options).value();
  DeadReckoning later = DeadReckoning::create(options).value();
  const auto motions = test_motions(drive, 32.5, 1, 7);
  for (std::size_t i = 0; i < motions.size(); ++i) {
    if (i == motions.size() / 2) {
      ASSERT_TRUE(later.restore(straight.save()));
    }
    straight.add(std::get<RelativeMotion>(motions[i]));
    if (i >= motions.size() / 2) later.add(std::get<RelativeMotion>(motions[i]));
  }
  EXPECT_EQ(straight.save(), later.save());
  Bytes cut = straight.save();
  cut.pop_back();
  const Status refused = later.restore(cut);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::store_damaged);
  EXPECT_EQ(straight.save(), later.save()) << "a refused memory changes nothing";
}

TEST(DeadReckoning, RefusesOptionsOutOfBounds) {
  VisionOptions options;
  options.drift_correlation_frames = 0;
  EXPECT_THAT(testing::error_message(DeadReckoning::create(options)),
              ::testing::HasSubstr("vision options: drift_correlation_frames is 0"));
}

}  // namespace
}  // namespace spartan
