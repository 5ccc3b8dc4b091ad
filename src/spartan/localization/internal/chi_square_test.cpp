#include "spartan/localization/internal/chi_square.h"

#include <gtest/gtest.h>

namespace spartan::internal {
namespace {

TEST(ChiSquare, MatchesTabulatedQuantiles) {
  EXPECT_NEAR(chi_square_quantile(0.95, 1), 3.841459, 1e-6);
  EXPECT_NEAR(chi_square_quantile(0.99, 2), 9.210340, 1e-6);
  EXPECT_NEAR(chi_square_quantile(0.999, 3), 16.266236, 1e-6);
  EXPECT_NEAR(chi_square_quantile(0.975, 180), 219.044, 1e-3);
  EXPECT_NEAR(chi_square_quantile(0.025, 180), 144.741, 1e-3);
}

TEST(ChiSquare, QuantileInvertsProbability) {
  for (int degrees = 1; degrees <= 7; ++degrees) {
    for (const double p : {1e-3, 0.1, 0.5, 0.9, 0.999, 1 - 1e-6})
      EXPECT_NEAR(chi_square_probability(chi_square_quantile(p, degrees), degrees), p, 1e-9) << degrees;
  }
  EXPECT_EQ(chi_square_probability(0, 3), 0);
}

}  // namespace
}  // namespace spartan::internal
