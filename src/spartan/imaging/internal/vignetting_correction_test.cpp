#include "spartan/imaging/internal/vignetting_correction.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace spartan::internal {
namespace {

using ::testing::HasSubstr;

Camera camera_with(std::vector<double> coefficients, PixelFormat format = {}) {
  Camera camera;
  camera.name = "left";
  camera.size = {64, 48};
  camera.model = PinholeModel{60, 60, 30, 25};
  camera.pixel_format = format;
  camera.vignetting.coefficients = std::move(coefficients);
  return camera;
}

// The formula of Vignetting in rig/rig.h.
double light(const Camera& camera, double cx, double cy, int x, int y) {
  const double rho2 = ((x - cx) * (x - cx) + (y - cy) * (y - cy)) / (0.25 * (64 * 64 + 48 * 48));
  const auto& a = camera.vignetting.coefficients;
  double sum = 1;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * std::pow(rho2, static_cast<double>(i + 1));
  return sum;
}

template <class T>
void expect_a_flat_field_flat(const Camera& camera, double cx, double cy, int level) {
  const auto correction = VignettingCorrection::create(camera, ThreadPool(2));
  ASSERT_TRUE(correction) << correction.error().message();
  Image<T> image(camera.size);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) image(x, y) = static_cast<T>(std::lround(level * light(camera, cx, cy, x, y)));
  }
  correction->apply(image, image, ThreadPool(2));
  for (int y = 0; y < 48; ++y) {
    // The sample was rounded before it was amplified.
    for (int x = 0; x < 64; ++x) {
      ASSERT_NEAR(image(x, y), level, 0.6 / light(camera, cx, cy, x, y) + 0.51 + level * 1e-4) << x << ", " << y;
    }
  }
}

TEST(VignettingCorrection, FlattensAFlatField) {
  expect_a_flat_field_flat<std::uint8_t>(camera_with({-0.3}), 30, 25, 200);
  expect_a_flat_field_flat<std::uint16_t>(camera_with({-0.5, 0.2, -0.1}, {PixelLayout::gray, 12}), 30, 25, 3000);
  Camera shifted = camera_with({-0.4, 0.1});
  shifted.vignetting.centre_px = Eigen::Vector2d(20, 40);
  expect_a_flat_field_flat<std::uint8_t>(shifted, 20, 40, 150);
}

TEST(VignettingCorrection, LeavesTheBlackLevelWhereItIs) {
  Camera camera = camera_with({-0.5}, {PixelLayout::gray, 12});
  camera.driver.emplace();
  camera.driver->black_level = 256;
  const auto correction = VignettingCorrection::create(camera, ThreadPool(1));
  ASSERT_TRUE(correction);
  const auto corrected = [&](int value, int x, int y) {
    Image<std::uint16_t> image(64, 48, static_cast<std::uint16_t>(value));
    correction->apply(image, image, ThreadPool(1));
    return image(x, y);
  };
  EXPECT_EQ(corrected(256, 60, 3), 256) << "no light";
  const double illumination = light(camera, 30, 25, 60, 3);
  EXPECT_NEAR(corrected(756, 60, 3), 256 + 500 / illumination, 1);
  EXPECT_NEAR(corrected(246, 60, 3), 256 - 10 / illumination, 1) << "noise below it";
  EXPECT_EQ(corrected(0, 60, 3), 0);
  EXPECT_EQ(corrected(4090, 60, 3), 4095);
}

TEST(VignettingCorrection, SaturatesAtFullScale) {
  const PixelFormat high{PixelLayout::gray, 12, BitAlignment::high};
  const Camera camera = camera_with({-0.6}, high);
  const auto correction = VignettingCorrection::create(camera, ThreadPool(1));
  ASSERT_TRUE(correction);
  Image<std::uint16_t> image(64, 48, 0xFFF0);
  correction->apply(image, image, ThreadPool(1));
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) ASSERT_EQ(image(x, y), 0xFFF0);
  }
}

TEST(VignettingCorrection, ZeroCoefficientsChangeNothing) {
  const auto correction = VignettingCorrection::create(camera_with({0}), ThreadPool(1));
  Image<std::uint8_t> image(64, 48);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) image(x, y) = static_cast<std::uint8_t>(x * y);
  }
  Image<std::uint8_t> result(image.size());
  correction->apply(image, result, ThreadPool(1));
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) ASSERT_EQ(result(x, y), image(x, y));
  }
}

TEST(VignettingCorrection, RejectsIlluminationOutOfRange) {
  const auto rejected = VignettingCorrection::create(camera_with({-1.2}), ThreadPool(1));
  ASSERT_FALSE(rejected);
  EXPECT_EQ(rejected.error().code, ErrorCode::configuration);
  EXPECT_THAT(rejected.error().message(), HasSubstr("cameras.left.vignetting"));
}

}  // namespace
}  // namespace spartan::internal
