#include "spartan/localization/internal/noise_ratio.h"

#include <gtest/gtest.h>

#include "spartan/localization/internal/drive_test.h"

namespace spartan::internal {
namespace {

TEST(NoiseRatio, IsThatOfTheReadings) {
  constexpr double kStated = 4e-4, kPredicted = 1e-4;
  ErrorCovariance p = ErrorCovariance::Zero();
  p(error_at::kCompassOffset, error_at::kCompassOffset) = kPredicted;
  for (const double truth : {0.25, 1.0, 4.0, 9.0}) {
    Random random(7, 1);
    NoiseRatio noise;
    for (int k = 0; k < 3000; ++k) {
      Innovation i(2);
      i.jacobian(0, error_at::kCompassOffset) = i.jacobian(1, error_at::kCompassOffset) = 1;
      for (int row = 0; row < 2; ++row) i.residual[row] = random.normal(0, std::sqrt(kPredicted + truth * kStated));
      noise.add(p, i, kStated);
    }
    // Four standard deviations of a fading mean of 600 samples of two rows.
    EXPECT_NEAR(noise.factor(), truth, 4 * (truth + kPredicted / kStated) * std::sqrt(2.0 / 1200));
  }
}

TEST(NoiseRatio, StartsAtTheStatedValueAndIsBounded) {
  NoiseRatio noise;
  EXPECT_EQ(noise.factor(), 1);
  noise.add(1e9);
  EXPECT_LT(noise.factor(), 2.3) << "one outlier says little";
  for (int k = 0; k < 10000; ++k) noise.add(1e9);
  EXPECT_EQ(noise.factor(), 16);
  for (int k = 0; k < 10000; ++k) noise.add(-1);
  EXPECT_EQ(noise.factor(), 0.25);
}

/// The samples with other stated standard deviations of compass and inclinometer.
std::vector<Measurement> stated(std::vector<Measurement> samples, double factor) {
  for (Measurement& m : samples) {
    if (auto* compass = std::get_if<CompassSample>(&m)) compass->sigma_rad *= factor;
    if (auto* tilt = std::get_if<InclinometerSample>(&m)) tilt->sigma_rad *= factor;
  }
  return samples;
}

// Beside an IMU, standard deviations that are stated wrong by 2 cost little: that of the compass offset is 6 % too
// small or 19 % too large (32 and 72 % without the measurement).
TEST(NoiseRatio, IsMeasuredByTheLocalization) {
  const double seconds = 152.5;
  const auto all = in_order(test_samples(TestDrive(), seconds, {true, false, true, true}, 9),
                            test_motions(TestDrive(), seconds, 1, 9));
  const auto sigma = [&](double factor) {
    return driven(test_options(), stated(all, factor)).estimate().heading.compass_offset_sigma_rad;
  };
  const double right = sigma(1);
  EXPECT_NEAR(sigma(0.5) / right, 1, 0.25);
  EXPECT_NEAR(sigma(2) / right, 1, 0.25);
}

}  // namespace
}  // namespace spartan::internal
