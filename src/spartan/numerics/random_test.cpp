#include "spartan/numerics/random.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <stdexcept>

namespace spartan {
namespace {

// The first numbers of the demo program published with PCG32 (pcg-random.org): seed 42, stream 54.
TEST(Random, ReproducesThePublishedSequence) {
  Random random(42, 54);
  for (const std::uint32_t expected : {0xa15c02b7U, 0x7b47f409U, 0xba1d3330U, 0x83d2f293U, 0xbfa4784bU, 0xcbed606eU}) {
    EXPECT_EQ(random.next(), expected);
  }
}

TEST(Random, SeedsAndStreamsDiffer) {
  Random a(1), b(2), c(1, 1);
  const std::uint32_t first = a.next();
  EXPECT_NE(first, b.next());
  EXPECT_NE(first, c.next());
}

// The tolerances below are five standard errors of the sampled moment.
TEST(Random, UniformHasTheExpectedMoments) {
  Random random(5);
  const int count = 200000;
  double sum = 0, squares = 0;
  for (int i = 0; i < count; ++i) {
    const double u = random.uniform();
    ASSERT_GE(u, 0.0);
    ASSERT_LT(u, 1.0);
    sum += u;
    squares += u * u;
  }
  EXPECT_NEAR(sum / count, 0.5, 5 * std::sqrt(1.0 / 12.0 / count));
  EXPECT_NEAR(squares / count, 1.0 / 3.0, 5 * std::sqrt(4.0 / 45.0 / count));
}

TEST(Random, NormalHasTheExpectedMoments) {
  Random random(6);
  const int count = 200000;
  std::array<double, 5> moments{};
  int beyond_two_sigma = 0;
  for (int i = 0; i < count; ++i) {
    const double z = random.normal();
    for (std::size_t k = 1; k < moments.size(); ++k) moments[k] += std::pow(z, static_cast<double>(k)) / count;
    beyond_two_sigma += std::abs(z) > 2.0;
  }
  EXPECT_NEAR(moments[1], 0.0, 5 * std::sqrt(1.0 / count));
  EXPECT_NEAR(moments[2], 1.0, 5 * std::sqrt(2.0 / count));
  EXPECT_NEAR(moments[3], 0.0, 5 * std::sqrt(15.0 / count));
  EXPECT_NEAR(moments[4], 3.0, 5 * std::sqrt(96.0 / count));
  EXPECT_NEAR(static_cast<double>(beyond_two_sigma) / count, 0.0455003, 5 * std::sqrt(0.0455 * 0.9545 / count));
}

TEST(Random, BelowIsUniform) {
  Random random(8);
  std::array<int, 6> hits{};
  const int count = 120000;
  for (int i = 0; i < count; ++i) ++hits.at(random.below(6));
  double chi_squared = 0;
  for (const int n : hits) chi_squared += std::pow(n - count / 6.0, 2) / (count / 6.0);
  EXPECT_LT(chi_squared, 25.7) << "5 degrees of freedom, p = 1e-4";
  EXPECT_EQ(random.below(1), 0U);
  EXPECT_THROW(random.below(0), std::invalid_argument);
}

// A bound above 2³¹ exposes the bias of a plain remainder: it would draw low values twice as often.
TEST(Random, BelowHasNoBiasForLargeBounds) {
  Random random(9);
  const std::uint32_t bound = 0xC0000000U;
  int low = 0;
  const int count = 60000;
  for (int i = 0; i < count; ++i) low += random.below(bound) < 0x40000000U;
  EXPECT_NEAR(static_cast<double>(low) / count, 1.0 / 3.0, 5 * std::sqrt(2.0 / 9.0 / count));
}

}  // namespace
}  // namespace spartan
