#include "spartan/odometry/internal/reconstruction/row_correlation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "spartan/numerics/random.h"
#include "spartan/odometry/internal/each_target_test.h"

namespace spartan::internal {
namespace {

Image<std::uint8_t> random_image(std::uint64_t seed) {
  Image<std::uint8_t> image(97, 31);
  Random random(seed);
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) image(x, y) = static_cast<std::uint8_t>(random.below(256));
  return image;
}

double brute_force_correlation(const Image<std::uint8_t>& a, int ax, const Image<std::uint8_t>& b, int bx, int y) {
  double sum_a = 0, sum_b = 0, aa = 0, bb = 0, ab = 0;
  int n = 0;
  for (int j = -kCorrelationRadiusY; j <= kCorrelationRadiusY; ++j) {
    for (int i = -kCorrelationRadiusX; i <= kCorrelationRadiusX; ++i, ++n) {
      const double p = a(ax + i, y + j), q = b(bx + i, y + j);
      sum_a += p;
      sum_b += q;
      aa += p * p;
      bb += q * q;
      ab += p * q;
    }
  }
  return (ab - sum_a * sum_b / n) / std::sqrt((aa - sum_a * sum_a / n) * (bb - sum_b * sum_b / n));
}

TEST(RowCorrelation, IsPearsonsCoefficientAtEveryPosition) {
  const Image<std::uint8_t> a = random_image(1), b = random_image(2);
  with_each_target([&] {
    for (const auto& [from, to] : {std::pair(7, 89), {20, 20}, {30, 51}}) {
      const std::vector<float> scores = correlate_row(a, 40, 12, b, from, to);
      ASSERT_EQ(scores.size(), static_cast<std::size_t>(to - from + 1));
      for (int x = from; x <= to; ++x) {
        EXPECT_NEAR(scores[static_cast<std::size_t>(x - from)], brute_force_correlation(a, 40, b, x, 12), 1e-5);
      }
    }
  });
}

TEST(RowCorrelation, IsInvariantToContrastAndMinusOneWithoutTexture) {
  const Image<std::uint8_t> a = random_image(1);
  Image<std::uint8_t> b(97, 31);
  for (int y = 0; y < 31; ++y)
    for (int x = 0; x < 97; ++x) b(x, y) = static_cast<std::uint8_t>(20 + a(x, y) / 2);
  EXPECT_GT(correlate_row(a, 40, 12, b, 40, 40)[0], 0.999f);
  const Image<std::uint8_t> flat(97, 31, 100);
  EXPECT_EQ(correlate_row(a, 40, 12, flat, 30, 50)[5], -1.0f);
  EXPECT_EQ(correlate_row(flat, 40, 12, a, 30, 50)[5], -1.0f);
}

}  // namespace
}  // namespace spartan::internal
