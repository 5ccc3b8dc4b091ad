#include "spartan/imaging/internal/contrast.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "spartan/numerics/random.h"

namespace spartan::internal {
namespace {

// A horizontal ramp from `low` to `high`, shifted up by `shift` bits.
template <class T>
Image<T> ramp(int low, int high, int shift = 0) {
  const int width = high - low + 1;
  Image<T> image(width, 4);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < width; ++x) image(x, y) = static_cast<T>((low + x) << shift);
  }
  return image;
}

template <class T>
ContrastMapping stretched(PixelFormat format, ImageView<const T> left, ImageView<const T> right, double low = 0.1,
                          double high = 99.9) {
  GrayHistogram histogram(format);
  histogram.add(left);
  histogram.add(right);
  ContrastMapping mapping(format);
  mapping.stretch(histogram, low, high);
  return mapping;
}

TEST(Contrast, ComputesPercentiles) {
  GrayHistogram histogram({});
  histogram.add(ramp<std::uint8_t>(10, 109).view());
  EXPECT_EQ(histogram.percentile(0), 10);
  EXPECT_EQ(histogram.percentile(50), 60);
  EXPECT_EQ(histogram.percentile(99.5), 109);
  EXPECT_EQ(histogram.percentile(100), 109);
}

TEST(Contrast, CountsSamplesInsideTheMaskOnly) {
  const auto image = ramp<std::uint8_t>(10, 109);
  Image<std::uint8_t> mask(image.size());
  for (int x = 50; x < 100; ++x) mask(x, 2) = 1;
  GrayHistogram histogram({});
  EXPECT_TRUE(histogram.empty());
  histogram.add(image, mask);
  EXPECT_EQ(histogram.percentile(0), 60);
  EXPECT_EQ(histogram.percentile(50), 85);
  EXPECT_EQ(histogram.percentile(100), 109);
  EXPECT_THROW(histogram.add(image, mask.view().crop(0, 0, 5, 4)), std::invalid_argument);
}

TEST(Contrast, AFullRangeIsNotChanged) {
  const auto image = ramp<std::uint8_t>(0, 255);
  const ContrastMapping mapping = stretched<std::uint8_t>({}, image, image);
  for (int level = 0; level < 256; ++level) EXPECT_EQ(mapping(level), level);
}

TEST(Contrast, BothImagesGetOneMapping) {
  const auto dark = ramp<std::uint8_t>(40, 99);
  const auto bright = ramp<std::uint8_t>(80, 139);
  const ContrastMapping mapping = stretched<std::uint8_t>({}, dark, bright, 0, 100);
  EXPECT_EQ(mapping(40), 0);
  EXPECT_EQ(mapping(139), 255);
  EXPECT_EQ(mapping(0), 0);
  EXPECT_EQ(mapping(255), 255);
  EXPECT_NEAR(mapping(90), 255.0 * 50 / 99, 0.5);
}

TEST(Contrast, LowAndHighAlignmentGiveTheSame) {
  const PixelFormat low{PixelLayout::gray, 12, BitAlignment::low}, high{PixelLayout::gray, 12, BitAlignment::high};
  const auto stored_low = ramp<std::uint16_t>(500, 1500), stored_high = ramp<std::uint16_t>(500, 1500, 4);
  const auto mapping_low = stretched<std::uint16_t>(low, stored_low, stored_low);
  const auto mapping_high = stretched<std::uint16_t>(high, stored_high, stored_high);
  Image<std::uint8_t> from_low(stored_low.size()), from_high(stored_high.size());
  mapping_low.apply(stored_low, from_low, ThreadPool(1));
  mapping_high.apply(stored_high, from_high, ThreadPool(2));
  for (int x = 0; x < from_low.width(); ++x) EXPECT_EQ(from_low(x, 3), from_high(x, 3));
  EXPECT_EQ(from_low(0, 0), 0);
  EXPECT_EQ(from_low(from_low.width() - 1, 0), 255);
}

TEST(Contrast, SixteenBitsWithoutStretchAreScaled) {
  const ContrastMapping mapping(PixelFormat{PixelLayout::gray, 16, BitAlignment::low});
  EXPECT_EQ(mapping(0), 0);
  EXPECT_EQ(mapping(32768), 128);
  EXPECT_EQ(mapping(65535), 255);
}

// A few noisy pixels more or less must not change the whole image.
TEST(Contrast, AConstantImageIsMappedLikeANearlyConstantOne) {
  for (const int level : {0, 3, 77, 250, 254}) {
    SCOPED_TRACE(level);
    Image<std::uint8_t> image(40, 50, static_cast<std::uint8_t>(level));
    const int constant = stretched<std::uint8_t>({}, image, image)(level);
    for (int x = 0; x < 4; ++x) image(x, 7) = static_cast<std::uint8_t>(level + 1);  // 0.2 %
    EXPECT_NEAR(stretched<std::uint8_t>({}, image, image)(level), constant, 8) << "half of a level, stretched";
  }
  const Image<std::uint8_t> black(8, 8, 0), white(8, 8, 255);
  EXPECT_EQ(stretched<std::uint8_t>({}, black, black)(0), 0);
  EXPECT_EQ(stretched<std::uint8_t>({}, white, white)(255), 255);
}

TEST(Contrast, NoiseIsNotAmplified) {
  // The same nearly constant image at any bit depth: ± 0.3 % of full scale.
  for (const int bits : {8, 10, 12, 14, 16}) {
    SCOPED_TRACE(bits);
    const PixelFormat format{PixelLayout::gray, bits};
    const int middle = (2000 << bits) >> 12, spread = std::max(1, (12 << bits) >> 12);
    const auto image = ramp<std::uint16_t>(middle - spread, middle + spread);
    GrayHistogram histogram(format);
    histogram.add(image);
    ContrastMapping mapping(format);
    mapping.stretch(histogram, 0.1, 99.9);
    EXPECT_NEAR(mapping(middle), 127.5, 8);
    EXPECT_LE(mapping(middle + spread) - mapping(middle - spread), 33);
    EXPECT_GE(mapping(middle + spread) - mapping(middle - spread), 20);
  }
}

TEST(Contrast, QuantilesAreInterpolatedBetweenLevels) {
  GrayHistogram histogram({});
  histogram.add(ramp<std::uint8_t>(10, 109).view());
  EXPECT_NEAR(histogram.quantile(50), 59.5, 1e-9);
  EXPECT_NEAR(histogram.quantile(0), 9.5, 1e-9);
  EXPECT_NEAR(histogram.quantile(100), 109.5, 1e-9);
}

TEST(Contrast, FindsTheGainBetweenTheImages) {
  const PixelFormat format{PixelLayout::gray, 12};
  const auto histogram_of = [&](double factor) {
    Image<std::uint16_t> image(100, 40);
    for (int y = 0; y < 40; ++y) {
      for (int x = 0; x < 100; ++x) image(x, y) = static_cast<std::uint16_t>((600 + 12 * x + 7 * y) * factor);
    }
    GrayHistogram histogram(format);
    histogram.add(image);
    return histogram;
  };
  EXPECT_NEAR(gain_between(histogram_of(1), histogram_of(0.7)), 1 / 0.7, 0.01);
  EXPECT_NEAR(gain_between(histogram_of(0.7), histogram_of(1)), 0.7, 0.005);
  EXPECT_EQ(gain_between(histogram_of(1), histogram_of(1)), 1);
  EXPECT_EQ(gain_between(histogram_of(1), histogram_of(0.97)), 1) << "below the threshold";
  EXPECT_EQ(gain_between(histogram_of(1), histogram_of(0.4)), 2) << "limited to 2";
  EXPECT_EQ(gain_between(histogram_of(0.05), histogram_of(0.1)), 1) << "too dark to estimate";
}

GrayHistogram noisy_ramp(double factor, std::uint64_t seed) {
  Random random(seed);
  Image<std::uint8_t> image(160, 100);
  for (int y = 0; y < 100; ++y) {
    for (int x = 0; x < 160; ++x) {
      image(x, y) = static_cast<std::uint8_t>(std::lround(factor * (40 + x) + 2 * random.normal()));
    }
  }
  GrayHistogram histogram({});
  histogram.add(image);
  return histogram;
}

// Frames of a static scene must not flicker, whatever the true ratio.
TEST(Contrast, TheGainIsAContinuousFunctionOfTheRatio) {
  for (const double ratio : {0.93, 0.95, 1.0, 1.04, 1.05, 1.06, 1.1}) {
    double low = 2, high = 0, low_ratio = 2, high_ratio = 0;
    for (std::uint64_t frame = 0; frame < 8; ++frame) {
      const auto left = noisy_ramp(ratio, 2 * frame), right = noisy_ramp(1, 2 * frame + 1);
      const double gain = gain_between(left, right), estimate = brightness_ratio(left, right);
      EXPECT_NEAR(estimate, ratio, 0.006);
      EXPECT_NEAR(gain * gain_between(right, left), 1, 1e-12) << "symmetric in left and right";
      EXPECT_LE(std::abs(gain - 1), std::abs(estimate - 1));
      low = std::min(low, gain);
      high = std::max(high, gain);
      low_ratio = std::min(low_ratio, estimate);
      high_ratio = std::max(high_ratio, estimate);
    }
    EXPECT_LE(high - low, 2.2 * (high_ratio - low_ratio)) << ratio;
  }
}

TEST(Contrast, ACopyWithGainMapsScaledSamplesAlike) {
  const PixelFormat format{PixelLayout::gray, 12};
  const auto left = ramp<std::uint16_t>(800, 2400);
  ContrastMapping mapping = stretched<std::uint16_t>(format, left, left), copy(format);
  copy.copy_with_gain(mapping, 1.25);
  for (int level = 0; level < 4096; ++level) {
    if (level * 1.25 > 4095) break;
    ASSERT_NEAR(copy(level), mapping(static_cast<int>(std::lround(level * 1.25))), 1) << level;
  }
  copy.copy_with_gain(mapping, 1);
  for (int level = 0; level < 4096; ++level) ASSERT_EQ(copy(level), mapping(level));
}

TEST(Contrast, StrayBitsStayInsideTheTable) {
  const PixelFormat format{PixelLayout::gray, 10, BitAlignment::low};
  const Image<std::uint16_t> image(4, 4, 0xffff);
  Image<std::uint8_t> result(4, 4);
  const ContrastMapping mapping = stretched<std::uint16_t>(format, image, image);
  mapping.apply(image, result, ThreadPool(1));
  EXPECT_EQ(result(0, 0), 255);
}

}  // namespace
}  // namespace spartan::internal
