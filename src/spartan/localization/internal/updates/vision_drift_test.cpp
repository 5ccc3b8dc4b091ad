#include "spartan/localization/internal/updates/vision_drift.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace spartan::internal {
namespace {

TEST(VisionDrift, IsAStationaryProcess) {
  VisionOptions options;
  options.drift_sigma_ratios = {0.5, 0.4, 0.3, 0.2, 0.1, 0.6};
  options.drift_correlation_frames = 4;
  const VisionDrift drift(options);
  StateEstimate estimate;
  drift.start(estimate.covariance);
  const ErrorCovariance start = estimate.covariance;
  estimate.state.vision_drift.setConstant(1);
  estimate.covariance(error_at::kVisionDrift, 0) = estimate.covariance(0, error_at::kVisionDrift) = 0.01;
  for (int i = 0; i < 4; ++i) drift.propagate(estimate);
  EXPECT_NEAR(estimate.state.vision_drift[3], std::exp(-1), 1e-12);
  EXPECT_NEAR(estimate.covariance(error_at::kVisionDrift, 0), 0.01 * std::exp(-1), 1e-14);
  EXPECT_LT((estimate.covariance.diagonal() - start.diagonal()).norm(), 1e-12);
  EXPECT_NEAR(start(error_at::kVisionDrift + 1, error_at::kVisionDrift + 1), 0.16, 1e-12);
}

TEST(VisionDrift, NeedsSixRatios) {
  VisionOptions options;
  options.constant_sigma_ratios = {1, 2};
  EXPECT_THROW(VisionDrift{options}, std::invalid_argument);
}

}  // namespace
}  // namespace spartan::internal
