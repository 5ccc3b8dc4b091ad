#include "spartan/numerics/gradient_noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "spartan/numerics/random.h"

namespace spartan {
namespace {

constexpr std::uint32_t kNoiseSeed = 4711;

TEST(GradientNoise, GradientIsTheDerivativeOfTheValue) {
  Random random(1);
  for (int i = 0; i < 2000; ++i) {
    const double x = random.uniform(-50, 50), y = random.uniform(-50, 50);
    constexpr double h = 1e-5;
    const NoiseSample at = gradient_noise(x, y, kNoiseSeed);
    const auto value = [](double px, double py) { return gradient_noise_value(px, py, kNoiseSeed); };
    EXPECT_EQ(at.value, value(x, y));
    EXPECT_NEAR(at.dx, (value(x + h, y) - value(x - h, y)) / (2 * h), 1e-7) << x << " " << y;
    EXPECT_NEAR(at.dy, (value(x, y + h) - value(x, y - h)) / (2 * h), 1e-7) << x << " " << y;
  }
}

// On both sides of a cell's boundary: value, gradient and second derivatives.
TEST(GradientNoise, IsTwiceContinuouslyDifferentiable) {
  Random random(2);
  for (int i = 0; i < 500; ++i) {
    const double line = std::floor(random.uniform(-20, 20)), across = random.uniform(-20, 20);
    constexpr double h = 1e-6;
    for (const bool swapped : {false, true}) {
      const auto at = [&](double offset) {
        return swapped ? gradient_noise(across, line + offset, kNoiseSeed)
                       : gradient_noise(line + offset, across, kNoiseSeed);
      };
      const NoiseSample before = at(-h), after = at(h), further_before = at(-2 * h), further_after = at(2 * h);
      EXPECT_NEAR(before.value, after.value, 1e-5);
      EXPECT_NEAR(before.dx, after.dx, 1e-4);
      EXPECT_NEAR(before.dy, after.dy, 1e-4);
      const auto slope = [&](const NoiseSample& s) { return swapped ? s.dy : s.dx; };
      EXPECT_NEAR((slope(before) - slope(further_before)) / h, (slope(further_after) - slope(after)) / h, 1e-3);
    }
  }
}

TEST(GradientNoise, HasTheStatedMomentsAndBounds) {
  Random random(3);
  double sum = 0, squares = 0, largest = 0, steepest = 0;
  constexpr int kCount = 200'000;
  for (int i = 0; i < kCount; ++i) {
    const double x = random.uniform(-500, 500), y = random.uniform(-500, 500);
    const NoiseSample at = gradient_noise(x, y, kNoiseSeed);
    sum += at.value;
    squares += at.value * at.value;
    largest = std::max(largest, std::abs(at.value));
    steepest = std::max(steepest, std::hypot(at.dx, at.dy));
  }
  EXPECT_NEAR(sum / kCount, 0, 0.003);
  EXPECT_NEAR(std::sqrt(squares / kCount), kNoiseSigma, 0.002);
  EXPECT_LT(largest, kNoiseMaxValue);
  EXPECT_GT(largest, 0.8 * kNoiseMaxValue);
  EXPECT_LT(steepest, kNoiseMaxSlope);
  EXPECT_GT(steepest, 0.7 * kNoiseMaxSlope);
  EXPECT_NE(gradient_noise_value(0.3, 0.4, 1), gradient_noise_value(0.3, 0.4, 2)) << "the seed";
}

TEST(GradientNoise, DirectionsAreEvenUnitVectors) {
  const double* d = noise_directions();
  for (std::uint32_t i = 0; i < kNoiseDirections; ++i) {
    const double *a = d + 2 * i, *b = d + 2 * ((i + 1) % kNoiseDirections);
    EXPECT_NEAR(std::hypot(a[0], a[1]), 1, 1e-14);
    EXPECT_NEAR(a[0] * b[0] + a[1] * b[1], std::cos(2 * M_PI / kNoiseDirections), 1e-14);
    EXPECT_GT(a[0] * b[1] - a[1] * b[0], 0) << "counter-clockwise";
  }
}

TEST(Octaves, HaveTheSumsDeviationAndTheStatedRatios) {
  const std::vector<Octave> octaves = make_octaves(5, 4, 8.0, 0.6, 0.25);
  ASSERT_EQ(octaves.size(), 4U);
  for (std::size_t i = 1; i < octaves.size(); ++i) {
    EXPECT_EQ(octaves[i].size, 0.5 * octaves[i - 1].size);
    EXPECT_NEAR(octaves[i].amplitude, 0.6 * octaves[i - 1].amplitude, 1e-12);
    EXPECT_NE(octaves[i].seed, octaves[i - 1].seed);
    EXPECT_NE(octaves[i].shift_x, octaves[i].shift_y);
  }
  EXPECT_EQ(octaves[0].size, 8);
  Random random(6);
  double squares = 0;
  constexpr int kCount = 200'000;
  for (int i = 0; i < kCount; ++i) {
    const double x = random.uniform(-3000, 3000), y = random.uniform(-3000, 3000);
    double value = 0;
    for (const Octave& octave : octaves) value += octave.value(x, y);
    squares += value * value;
  }
  EXPECT_NEAR(std::sqrt(squares / kCount), 0.25, 0.005);
}

TEST(Octaves, GradientIsTheDerivativeOfTheValue) {
  Random random(7);
  for (const Octave& octave : make_octaves(8, 3, 2.0, 0.5, 1.0)) {
    for (int i = 0; i < 200; ++i) {
      const double x = random.uniform(-50, 50), y = random.uniform(-50, 50);
      constexpr double h = 1e-6;
      const NoiseSample at = octave(x, y);
      EXPECT_EQ(at.value, octave.value(x, y));
      EXPECT_NEAR(at.dx, (octave.value(x + h, y) - octave.value(x - h, y)) / (2 * h), 1e-6);
      EXPECT_NEAR(at.dy, (octave.value(x, y + h) - octave.value(x, y - h)) / (2 * h), 1e-6);
    }
  }
}

}  // namespace
}  // namespace spartan
