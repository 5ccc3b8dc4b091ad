// What cannot be matched is unknown: no texture, no light, nothing in common.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>

#include "spartan/numerics/random.h"
#include "spartan/reconstruction/disparity_computer.h"

namespace spartan {
namespace {

constexpr ImageSize kSize{320, 240};

using Gray = std::function<double(int x, int y)>;

Image<std::uint8_t> image_of(const Gray& gray) {
  Image<std::uint8_t> image(kSize);
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x)
      image(x, y) = static_cast<std::uint8_t>(std::lround(std::clamp(gray(x, y), 0.0, 255.0)));
  }
  return image;
}

double known_percent(const Gray& left, const Gray& right, int to_row = kSize.height) {
  DisparityComputer computer = DisparityComputer::create(DisparityOptions{}, ThreadPool(1)).value();
  const auto result = computer.compute(image_of(left), image_of(right), {0, 95});
  EXPECT_TRUE(result) << result.error().message();
  int known = 0;
  for (int y = 0; y < to_row; ++y) {
    for (int x = 0; x < kSize.width; ++x) {
      const bool is_known = !std::isnan(result->disparity(x, y));
      known += is_known;
      EXPECT_EQ(is_known, !std::isnan(result->sigma(x, y)));
      if (!is_known) {
        EXPECT_EQ(result->outlier_percent(x, y), 100);
      }
    }
  }
  return 100.0 * known / (kSize.width * to_row);
}

// Independent noise of both images.
Gray noisy(double level, double sigma, std::uint64_t seed) {
  return [=, random = std::make_shared<Random>(seed)](int, int) { return random->normal(level, sigma); };
}

TEST(UnknownDisparity, BlackImages) {
  EXPECT_LE(known_percent(noisy(0, 0, 1), noisy(0, 0, 2)), 1);
  EXPECT_LE(known_percent(noisy(0, 0.7, 1), noisy(0, 0.7, 2)), 1) << "with noise of the sensor";
}

TEST(UnknownDisparity, ConstantImages) {
  EXPECT_LE(known_percent(noisy(120, 0, 1), noisy(120, 0, 2)), 1);
  EXPECT_LE(known_percent(noisy(120, 2, 1), noisy(120, 2, 2)), 1) << "with noise of the sensor";
  const Gray shading = [](int x, int y) { return 40 + 0.5 * x + 0.2 * y; };
  EXPECT_LE(known_percent(shading, shading), 1) << "a gray-level ramp";
}

// Shading with noise: the images have contrast in common, but nothing that can be matched.
TEST(UnknownDisparity, NoisyShading) {
  for (const double slope : {0.13, 0.31, 0.5}) {
    for (const double sigma : {0.7, 2.0}) {
      const auto shading = [=](std::uint64_t seed) -> Gray {
        return [=, noise = noisy(0, sigma, seed)](int x, int y) { return 60 + slope * x + 0.2 * y + noise(x, y); };
      };
      EXPECT_LE(known_percent(shading(1), shading(2)), 1) << slope << ", " << sigma;
    }
  }
}

TEST(UnknownDisparity, UnrelatedNoise) {
  for (const double sigma : {5.0, 20.0, 60.0})
    EXPECT_LE(known_percent(noisy(128, sigma, 1), noisy(128, sigma, 2)), 1) << sigma;
}

// A saturated sky above textured ground.
TEST(UnknownDisparity, SaturatedSky) {
  Random random(7);
  Image<std::uint8_t> texture(kSize.width + 20, kSize.height);
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < texture.width(); ++x) texture(x, y) = static_cast<std::uint8_t>(60 + random.below(90));
  }
  const auto view = [&](int shift) -> Gray {
    return [&texture, shift](int x, int y) { return y < 100 ? 255.0 : texture(x + shift, y); };
  };
  EXPECT_LE(known_percent(view(0), view(20), 92), 1);
}

// A noisy sky above ground with a rock before it: the smoothness of the matching carries disparities into the sky.
class SkyBehindARock : public ::testing::Test {
 protected:
  static constexpr int kShift = 20, kHorizon = 110;
  static bool is_rock(int x, int y) { return std::hypot(x - 170, y - 100) < 40; }
  // Of the left image; the whole scene but the sky has one disparity.
  static bool is_scene(int x, int y) { return y >= kHorizon || is_rock(x, y); }

  // `contrast`: standard deviation of the texture of the scene in gray levels.
  static DisparityImage disparities(DisparityComputer& computer, double contrast) {
    Random random(7);
    Image<float> texture(kSize.width + kShift, kSize.height);
    for (int y = 0; y < kSize.height; ++y) {
      for (int x = 0; x < texture.width(); ++x) texture(x, y) = static_cast<float>(random.normal(80, contrast));
    }
    const auto view = [&](int shift, std::uint64_t seed) -> Gray {
      return [&texture, shift, noise = noisy(0, 2, seed)](int x, int y) {
        return (is_scene(x + shift, y) ? texture(x + shift, y) : 130) + noise(x, y);
      };
    };
    return computer.compute(image_of(view(0, 1)), image_of(view(kShift, 2)), {0, 95}).value();
  }
};

TEST_F(SkyBehindARock, SkyIsUnlikely) {
  DisparityComputer computer = DisparityComputer::create(DisparityOptions{}, ThreadPool(1)).value();
  const DisparityImage result = disparities(computer, 15);
  int likely = 0, sky = 0, likely_scene = 0, scene = 0;
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 96; x < kSize.width; ++x) {
      const bool is_likely = result.outlier_percent(x, y) <= 20;
      if (is_scene(x, y)) {
        ++scene;
        likely_scene += is_likely;
        continue;
      }
      // The windows of the matching reach into the sky.
      if (is_scene(x, std::min(y + 4, kSize.height - 1)) || is_scene(x - 4, y) || is_scene(x + 4, y)) continue;
      ++sky;
      likely += is_likely;
    }
  }
  // Some of the sky between rock and horizon remains; without the test of the surroundings it is 14 %.
  EXPECT_LE(likely, 0.06 * sky);
  EXPECT_GE(likely_scene, 0.97 * scene);
}

TEST_F(SkyBehindARock, TextureBelowTheNoiseIsLikely) {
  DisparityComputer computer = DisparityComputer::create(DisparityOptions{}, ThreadPool(1)).value();
  const DisparityImage result = disparities(computer, 1.5);
  int likely = 0, known = 0;
  for (int y = kHorizon + 10; y < kSize.height - 10; ++y) {
    for (int x = 96; x < kSize.width - 10; ++x) {
      known += !std::isnan(result.disparity(x, y));
      likely += result.outlier_percent(x, y) < 40;
    }
  }
  EXPECT_GE(likely, 0.9 * known);
  EXPECT_GE(known, 0.9 * (kSize.width - 106) * (kSize.height - kHorizon - 20));
}

}  // namespace
}  // namespace spartan
