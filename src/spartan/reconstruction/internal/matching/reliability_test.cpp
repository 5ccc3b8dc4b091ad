#include "spartan/reconstruction/internal/matching/reliability.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace spartan::internal::matching {
namespace {

TEST(OutlierProbability, IsTheLogisticFunctionOfInformationAndRightDistance) {
  for (const double information : {2.5, 8.0, 40.0, 300.0, 5000.0}) {
    for (const int distance : {0, 1, 3, 16}) {
      const double logit = 4.586 + 0.571 * std::log2(1.0 + distance) - 0.882 * std::log2(information);
      EXPECT_NEAR(outlier_percent(static_cast<float>(information), distance), 100 / (1 + std::exp(-logit)), 3.5)
          << information << ", " << distance;
    }
  }
}

TEST(OutlierProbability, FallsWithTheInformationAndRisesWithTheDistance) {
  for (float information = 0.001F; information < 1e6F; information *= 1.07F) {
    EXPECT_GE(outlier_percent(information, 0), outlier_percent(information * 1.07F, 0));
    for (int distance = 0; distance < 20; ++distance)
      EXPECT_LE(outlier_percent(information, distance), outlier_percent(information, distance + 1));
  }
}

TEST(DisparitySigma, FallsToAFloor) {
  EXPECT_NEAR(disparity_sigma(100), std::sqrt(4.5 * 4.5 / 100 + 0.04 * 0.04), 1e-6);
  EXPECT_NEAR(disparity_sigma(1e9F), 0.04, 1e-3);
}

TEST(Reliability, DiscardsWhatIsTooUnlikely) {
  const float unknown = std::numeric_limits<float>::quiet_NaN();
  Image<float> information(3, 1, 1000.0F), disparity(3, 1, 7.0F), sigma(3, 1);
  Image<std::uint8_t> distance(3, 1), percent(3, 1);
  information(1, 0) = 4;
  disparity(2, 0) = unknown;
  assess({information, distance, 70}, ThreadPool(1), {disparity, sigma, percent});
  clear_unknown(ThreadPool(1), {disparity, sigma, percent});
  EXPECT_EQ(disparity(0, 0), 7);
  EXPECT_LT(percent(0, 0), 5);
  EXPECT_NEAR(sigma(0, 0), 0.148, 0.001);
  for (const int x : {1, 2}) {
    EXPECT_TRUE(std::isnan(disparity(x, 0)) && std::isnan(sigma(x, 0))) << x;
    EXPECT_EQ(percent(x, 0), 100) << x;
  }
}

}  // namespace
}  // namespace spartan::internal::matching
