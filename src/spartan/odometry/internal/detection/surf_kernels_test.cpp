#include "spartan/odometry/internal/detection/surf_kernels.h"

#include <gtest/gtest.h>

#include <cmath>

#include "spartan/numerics/random.h"
#include "spartan/odometry/internal/detection/surf.h"
#include "spartan/odometry/internal/each_target_test.h"

namespace spartan::internal {
namespace {

IntegralImage integral_of_noise(int width, int height) {
  Random random(9);
  Image<std::uint8_t> image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image(x, y) = static_cast<std::uint8_t>(random.below(256));
  }
  IntegralImage integral;
  integral.compute(image);
  return integral;
}

TEST(SurfKernels, RowsHaveTheDeterminantsOfSinglePixels) {
  const IntegralImage integral = integral_of_noise(140, 130);
  with_each_target([&] {
    for (const auto& [step, filter_px] : {std::pair(1, 9), {1, 27}, {2, 15}, {4, 51}, {8, 99}}) {
      const int first = filter_px / 2 + 1, count = (140 - 2 * first) / step, y = 65;
      std::vector<float> row(static_cast<std::size_t>(count + kSurfPadding));
      hessian_row(integral, y, first, count, filter_px, step, row.data());
      for (int i = 0; i < count; ++i) {
        const float expected = box_hessian(integral, first + i * step, y, filter_px).determinant();
        EXPECT_NEAR(row[static_cast<std::size_t>(i)], expected, 1e-4 * std::max(1.0f, std::abs(expected)))
            << filter_px << " " << i;
      }
    }
  });
}

TEST(SurfKernels, FindsMaximaWithinARange) {
  std::vector<float> zero(80, 0.0f), row(80, 0.0f);
  for (const std::size_t x : {3UL, 17UL, 18UL, 40UL, 61UL, 62UL}) row[x] = 2.0f;
  row[18] = 3.0f;  // 17 has a larger neighbour
  row[30] = 0.5f;  // below the threshold
  std::vector<float> above = zero;
  above[40] = 4.0f;
  row[61] = 2.5f;
  with_each_target([&] {
    std::vector<int> columns;
    maxima_of_row(above.data(), row.data(), zero.data(), 4, 60, 1.0f, columns);
    EXPECT_EQ(columns, std::vector<int>{18});
    columns.clear();
    maxima_of_row(above.data(), row.data(), zero.data(), 1, 62, 1.0f, columns);
    EXPECT_EQ(columns, (std::vector<int>{3, 18, 61}));
  });
}

TEST(SurfKernels, HaarSumsAreThoseOfBoxes) {
  const IntegralImage integral = integral_of_noise(140, 130);
  // Inside, rotated, and over the corner of the image.
  const DescriptorPlace places[] = {
      {70.2f, 61.1f, 1.7f, 1, 0, 2}, {60.4f, 66.3f, 2.6f, 0.8f, 0.6f, 3}, {4, 3, 2, 1, 0, 2}};
  with_each_target([&] {
    for (const DescriptorPlace& p : places) {
      std::array<double, 64> expected{};
      for (int j = 0; j < 20; ++j) {
        for (int i = 0; i < 20; ++i) {
          const float a = static_cast<float>(i) - 9.5f, b = static_cast<float>(j) - 9.5f;
          const int x = static_cast<int>(std::nearbyint(p.x + 0.5f + (p.scale * p.cosine * a - p.scale * p.sine * b)));
          const int y = static_cast<int>(std::nearbyint(p.y + 0.5f + (p.scale * p.sine * a + p.scale * p.cosine * b)));
          const auto box = [&](int x0, int y0, int x1, int y1) {
            return static_cast<double>(integral.clipped_box(x0, y0, x1, y1));
          };
          const int h = p.half;
          const double u = box(x, y - h, x + h, y + h) - box(x - h, y - h, x, y + h),
                       v = box(x - h, y, x + h, y + h) - box(x - h, y - h, x + h, y);
          const double weight = std::exp(-(a * a + b * b) / (2 * 3.3 * 3.3));
          const double dx = weight * (p.cosine * u + p.sine * v), dy = weight * (p.cosine * v - p.sine * u);
          double* const sums = &expected[static_cast<std::size_t>(4 * ((j / 5) * 4 + i / 5))];
          sums[0] += dx;
          sums[1] += std::abs(dx);
          sums[2] += dy;
          sums[3] += std::abs(dy);
        }
      }
      const std::array<float, 64> sums = haar_sums(integral, p);
      for (std::size_t k = 0; k < sums.size(); ++k) EXPECT_NEAR(sums[k], expected[k], 0.02) << p.x << " " << k;
    }
  });
}

}  // namespace
}  // namespace spartan::internal
