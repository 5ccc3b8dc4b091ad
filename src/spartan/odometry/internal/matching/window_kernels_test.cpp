#include "spartan/odometry/internal/matching/window_kernels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "spartan/numerics/random.h"
#include "spartan/odometry/internal/each_target_test.h"

namespace spartan::internal {
namespace {

Image<std::uint16_t> noise_image(int width, int height) {
  Random random(5);
  Image<std::uint16_t> image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image(x, y) = static_cast<std::uint16_t>(random.below(65281));
  }
  return image;
}

double bilinear(ImageView<const std::uint16_t> image, double x, double y) {
  const int i = static_cast<int>(x), j = static_cast<int>(y);
  const double a = x - i, b = y - j;
  return ((1 - b) * ((1 - a) * image(i, j) + a * image(i + 1, j)) +
          b * ((1 - a) * image(i, j + 1) + a * image(i + 1, j + 1))) /
         256;
}

double value_at(const WindowPlace& p, int i, int j) {
  const auto a = static_cast<float>(i), b = static_cast<float>(j);
  return bilinear(p.image, p.x + p.xx * a + p.xy * b, p.y + p.yx * a + p.yy * b);
}

double weight_at(int i, int j) {
  return std::exp(-(i * i + j * j) / 32.0);
}

Window window_of(const std::function<double(int, int)>& value) {
  Window window;
  for (int j = -kWindowRadius; j <= kWindowRadius; ++j) {
    for (int i = -kWindowRadius; i <= kWindowRadius; ++i) {
      window.values[static_cast<std::size_t>((j + kWindowRadius) * kWindowStride + i + kWindowRadius)] =
          static_cast<float>(value(i, j));
    }
  }
  return window;
}

double sum_over_window(const std::function<double(int, int)>& value) {
  double sum = 0;
  for (int j = -kWindowRadius; j <= kWindowRadius; ++j)
    for (int i = -kWindowRadius; i <= kWindowRadius; ++i) sum += value(i, j);
  return sum;
}

TEST(WindowKernels, SumsAreThoseOfBilinearInterpolation) {
  const Image<std::uint16_t> image = noise_image(48, 40), narrow = noise_image(20, 17);
  const WindowPlace places[] = {
      {image, 20, 17},
      {image, 20.3f, 17.8f, 1.2f, 0.3f, -0.2f, 0.9f},
      {image, 40.98f, 32.98f},  // reaches the last pixel that windows may use
      // Rows that are nearly those of the image, upwards and downwards, also along the borders.
      {image, 20.3f, 17.8f, 1.02f, 0.05f, 0.03f, 0.97f},
      {image, 20.3f, 17.8f, 0.97f, -0.05f, -0.03f, 1.02f},
      {image, 6, 6.2f, 1, 0, -0.03f, 1},
      {image, 40.98f, 32.8f, 1, 0, 0.03f, 1},
      // Wide, mirrored, and in a small image.
      {image, 23.7f, 18.2f, 1.8f, 0.2f},
      {image, 23.7f, 18.2f, -1, 0, 0.02f, 1},
      {narrow, 9.4f, 8.3f, 0.9f, 0.1f},
      {narrow, 9.4f, 8.3f, 0.9f, 0.1f, 0.02f, 1}};
  const double weights = sum_over_window(weight_at);
  with_each_target([&] {
    for (const WindowPlace& place : places) {
      std::array<Window, 4> factors;
      for (int k = 0; k < 4; ++k)
        factors[static_cast<std::size_t>(k)] = window_of([&](int i, int j) { return 0.01 * ((i + k) * j - k); });
      const WindowSums sums = window_sums(place, 100, factors.data(), 4);
      const auto value = [&](int i, int j) { return value_at(place, i, j) - 100; };
      EXPECT_NEAR(sums.mean, sum_over_window([&](int i, int j) { return weight_at(i, j) * value(i, j); }) / weights,
                  2e-3);
      EXPECT_NEAR(sums.square,
                  sum_over_window([&](int i, int j) { return weight_at(i, j) * value(i, j) * value(i, j); }) / weights,
                  0.1);
      for (int k = 0; k < 4; ++k) {
        EXPECT_NEAR(sums.products[static_cast<std::size_t>(k)],
                    sum_over_window([&](int i, int j) { return 0.01 * ((i + k) * j - k) * value(i, j); }), 0.1)
            << k;
      }
    }
  });
}

TEST(WindowKernels, GradientsAreCentralDifferences) {
  const Image<std::uint16_t> image = noise_image(48, 40);
  with_each_target([&] {
    const WindowPlace place{image, 22.25f, 18.5f};
    const WindowGradients g = window_gradients(image, place.x, place.y);
    for (int j = -kWindowRadius; j <= kWindowRadius; ++j) {
      for (int i = -kWindowRadius; i <= kWindowRadius; ++i) {
        const auto at = static_cast<std::size_t>((j + kWindowRadius) * kWindowStride + i + kWindowRadius);
        EXPECT_NEAR(g.value.values[at], value_at(place, i, j), 1e-3);
        EXPECT_NEAR(g.along_x.values[at], 0.5 * (value_at(place, i + 1, j) - value_at(place, i - 1, j)), 1e-3);
        EXPECT_NEAR(g.along_y.values[at], 0.5 * (value_at(place, i, j + 1) - value_at(place, i, j - 1)), 1e-3);
      }
    }
  });
}

TEST(WindowKernels, GradientsOfAPatchAreThoseOfItsPlace) {
  const Image<std::uint16_t> image = noise_image(48, 40);
  constexpr int x = 21, y = 19, r = kWindowRadius + 1;
  std::array<std::uint16_t, static_cast<std::size_t>(kWindowStride * kWindowStride)> patch{};
  for (int j = 0; j < kPatchSide; ++j)
    std::copy_n(image.row(y - r + j) + x - r, kPatchSide, patch.begin() + j * kWindowStride);
  with_each_target([&] {
    const WindowGradients g = patch_gradients(patch.data()), expected = window_gradients(image, x, y);
    EXPECT_EQ(g.value.values, expected.value.values);
    EXPECT_EQ(g.along_x.values, expected.along_x.values);
    EXPECT_EQ(g.along_y.values, expected.along_y.values);
  });
}

TEST(WindowKernels, WindowsWithoutTheirWeightedMean) {
  const auto value = [](int i, int j) { return 70 + 3 * i - j * j; };
  const double weights = sum_over_window(weight_at);
  const double mean = sum_over_window([&](int i, int j) { return weight_at(i, j) * value(i, j); }) / weights;
  const double variance =
      sum_over_window([&](int i, int j) { return weight_at(i, j) * std::pow(value(i, j) - mean, 2); }) / weights;
  with_each_target([&] {
    Window window = window_of(value);
    const WindowStatistics statistics = subtract_mean(window);
    EXPECT_NEAR(statistics.mean, mean, 1e-4);
    EXPECT_NEAR(statistics.variance, variance, 1e-3);
    for (int j = -kWindowRadius; j <= kWindowRadius; ++j) {
      const auto row = static_cast<std::size_t>((j + kWindowRadius) * kWindowStride);
      for (int i = -kWindowRadius; i <= kWindowRadius; ++i)
        EXPECT_NEAR(window.values[row + static_cast<std::size_t>(i + kWindowRadius)], value(i, j) - mean, 1e-4);
      for (std::size_t behind = kWindowSide; behind < kWindowStride; ++behind)
        EXPECT_EQ(window.values[row + behind], 0);
    }
  });
}

}  // namespace
}  // namespace spartan::internal
