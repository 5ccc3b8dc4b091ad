#include "spartan/sim/internal/camera/sensor.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "spartan/numerics/random.h"

namespace spartan::sim::internal {
namespace {

Camera camera_of(int width, int height, int bits = 8) {
  Camera camera;
  camera.name = "camera";
  camera.size = {width, height};
  camera.model = PinholeModel{400, 400, (width - 1) / 2.0, (height - 1) / 2.0};
  camera.pixel_format.bits = bits;
  return camera;
}

LuminanceImage uniform(const Camera& camera, float luminance) {
  LuminanceImage luminance_image;
  luminance_image.by_material[0] = Image<float>(camera.size.width, camera.size.height, luminance);
  return luminance_image;
}

double level(const FrameImage& image, int x, int y) {
  return image.format().bits > 8 ? image.as<std::uint16_t>()(x, y) : image.as<std::uint8_t>()(x, y);
}

struct Moments {
  double mean = 0, variance = 0;
};
Moments moments(const FrameImage& image) {
  Moments m;
  double squares = 0;
  const double n = static_cast<double>(image.width()) * image.height();
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      m.mean += level(image, x, y) / n;
      squares += level(image, x, y) * level(image, x, y) / n;
    }
  }
  m.variance = squares - m.mean * m.mean;
  return m;
}

// docs/math/photometry.md computes the same example by hand.
TEST(Sensor, ElectronsOf200LuxFollowFromTheChain) {
  const SensorOptions sensor;  // f/2, 5.5 µm, transmission 0.9, quantum efficiency 0.5
  const double luminance = 200 * 0.2 / std::numbers::pi;
  EXPECT_NEAR(luminance, 12.73, 0.01);
  const double lux = std::numbers::pi * 0.9 * luminance / (4 * 2.0 * 2.0);
  EXPECT_NEAR(lux, 2.25, 0.01);
  const double photons_per_lux_s_m2 = 1 / 683.0 / (6.62607015e-34 * 299792458.0 / 555e-9);
  EXPECT_NEAR(photons_per_lux_s_m2, 4.091e15, 0.002e15);
  const double rate = lux * photons_per_lux_s_m2 * 5.5e-6 * 5.5e-6 * 0.5;
  EXPECT_NEAR(luminance * electrons_per_second(sensor), rate, 1e-6 * rate);
  EXPECT_NEAR(rate, 1.392e5, 0.003e5);
  // The target of 0.45 · 15000 e− would need 48 ms: the exposure stops at its limit of 20 ms, and the gain does the
  // rest.
  const Exposure exposure = choose_exposure(sensor, luminance);
  EXPECT_DOUBLE_EQ(exposure.seconds, 0.020);
  EXPECT_NEAR(exposure.gain, 0.45 * 15000 / (rate * 0.020), 1e-9);
}

TEST(Sensor, AutoExposureRaisesTheTimeBeforeTheGain) {
  const SensorOptions sensor;
  const Exposure bright = choose_exposure(sensor, 4000), dim = choose_exposure(sensor, 5),
                 dark = choose_exposure(sensor, 1e-3);
  EXPECT_LT(bright.seconds, 0.001);
  EXPECT_EQ(bright.gain, 1);
  EXPECT_EQ(dim.seconds, 0.020);
  EXPECT_GT(dim.gain, 1);
  EXPECT_EQ(dark.gain, sensor.largest_gain);
  const Camera camera = camera_of(64, 64);
  const Sensor detector({.vignetting = 0}, camera);
  const auto image = detector.expose(uniform(camera, 4000), bright, {}, 1, ThreadPool(1));
  EXPECT_NEAR(moments(image).mean, 255 * (1.0 / 64 + 0.45 * (1 - 1.0 / 64)), 0.5);
}

// Photon transfer method (EMVA 1288): the slope of variance over mean is the gain in levels per electron.
TEST(Sensor, PhotonTransferGivesTheGain) {
  const Camera camera = camera_of(400, 400, 12);
  SensorOptions options;
  options.vignetting = 0;
  const Sensor detector(options, camera);
  for (const double gain : {1.0, 4.0}) {
    std::vector<double> means, variances;
    const Exposure exposure{0.002, gain};
    for (const float luminance : {20.0F, 60.0F, 120.0F, 200.0F}) {
      const Moments m = moments(detector.expose(uniform(camera, luminance / static_cast<float>(gain)), exposure, {},
                                                static_cast<std::uint64_t>(luminance), ThreadPool(2)));
      means.push_back(m.mean);
      variances.push_back(m.variance);
    }
    // Slope of the line through variance over mean.
    double sx = 0, sy = 0, sxx = 0, sxy = 0;
    const double n = static_cast<double>(means.size());
    for (std::size_t i = 0; i < means.size(); ++i) {
      sx += means[i];
      sy += variances[i];
      sxx += means[i] * means[i];
      sxy += means[i] * variances[i];
    }
    const double slope = (n * sxy - sx * sy) / (n * sxx - sx * sx);
    fmt::print("photon transfer: {:.5f} levels per electron, expected {:.5f} ({:+.2f} %)\n", slope,
               detector.levels_per_electron(exposure), 100 * (slope / detector.levels_per_electron(exposure) - 1));
    EXPECT_NEAR(slope, detector.levels_per_electron(exposure), 0.05 * slope) << "gain " << gain;
    // At the black level only the read noise is left: (levels per electron · 15 e−)² + 1/12 from quantization.
    const double black = options.black_level * 4095, at_black = sy / n + slope * (black - sx / n);
    const double read = detector.levels_per_electron(exposure) * options.read_noise_e;
    EXPECT_NEAR(at_black, read * read + 1.0 / 12, 0.15 * (read * read)) << "gain " << gain;
  }
}

TEST(Sensor, NoiseDependsOnTheSeedAndNotOnTheNumberOfThreads) {
  const Camera camera = camera_of(64, 48);
  const Sensor detector({}, camera);
  const Exposure exposure{0.001, 1};
  const auto one = detector.expose(uniform(camera, 800), exposure, {}, 5, ThreadPool(1)),
             two = detector.expose(uniform(camera, 800), exposure, {}, 5, ThreadPool(2));
  const auto other = detector.expose(uniform(camera, 800), exposure, {}, 6, ThreadPool(2));
  int same = 0;
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) {
      ASSERT_EQ(level(one, x, y), level(two, x, y));
      same += level(one, x, y) == level(other, x, y) ? 1 : 0;
    }
  }
  EXPECT_LT(same, 64 * 48 / 2);
}

TEST(Sensor, FaultsChangeTheImage) {
  const Camera camera = camera_of(200, 200);
  const Sensor detector({.vignetting = 0}, camera);
  const Exposure exposure = choose_exposure({}, 800);
  const ThreadPool workers(1);
  EXPECT_LT(moments(detector.expose(uniform(camera, 800), exposure, {.light_factor = 0.002}, 1, workers)).mean, 6);
  EXPECT_GT(moments(detector.expose(uniform(camera, 800), exposure, {.light_factor = 8}, 1, workers)).mean, 252);
  const Moments clean = moments(detector.expose(uniform(camera, 800), exposure, {}, 1, workers));
  const Moments dusty = moments(
      detector.expose(uniform(camera, 800), exposure, {.light_factor = 1, .dust = true, .dust_seed = 3}, 1, workers));
  EXPECT_GT(dusty.variance, 4 * clean.variance);
}

// Martian soil is red: of each 2 × 2 block the red pixel is the brightest, the blue one the darkest.
TEST(Sensor, BayerPixelsHaveTheirColour) {
  struct Layout {
    PixelLayout layout;
    int red_x, red_y;
  };
  for (const auto& [layout, red_x, red_y] :
       {Layout{PixelLayout::bayer_rggb, 0, 0}, Layout{PixelLayout::bayer_grbg, 1, 0},
        Layout{PixelLayout::bayer_gbrg, 0, 1}, Layout{PixelLayout::bayer_bggr, 1, 1}}) {
    Camera camera = camera_of(64, 64, 12);
    camera.pixel_format.layout = layout;
    const Sensor detector({.vignetting = 0}, camera);
    LuminanceImage luminance_image;
    luminance_image.split = true;
    for (auto& plane : luminance_image.by_material) plane = Image<float>(64, 64, 0.0F);
    luminance_image.by_material[0] = Image<float>(64, 64, 300.0F);
    const auto image = detector.expose(luminance_image, {0.001, 1}, {}, 1, ThreadPool(1));
    EXPECT_EQ(image.format().layout, layout);
    EXPECT_EQ(image.format().bits, 12);
    double red = 0, green = 0, blue = 0;
    for (int y = 0; y < 64; y += 2) {
      for (int x = 0; x < 64; x += 2) {
        red += level(image, x + red_x, y + red_y);
        green += 0.5 * (level(image, x + 1 - red_x, y + red_y) + level(image, x + red_x, y + 1 - red_y));
        blue += level(image, x + 1 - red_x, y + 1 - red_y);
      }
    }
    EXPECT_GT(red, 1.3 * green);
    EXPECT_GT(green, 1.3 * blue);
  }
}

// Levels per electron from black: what a dark image shows of each kind of noise, and what repeats from image to image.
TEST(Sensor, FixedPatternRepeatsAndRowNoiseIsCommonToARow) {
  const Camera camera = camera_of(200, 160, 12);
  const Exposure exposure{0.001, 1};
  const ThreadPool workers(1);
  const auto image_of = [&](SensorOptions options, float luminance, std::uint64_t seed) {
    options.vignetting = options.read_noise_e = 0;
    return Sensor(options, camera, {.pattern_seed = 4}).expose(uniform(camera, luminance), exposure, {}, seed, workers);
  };
  const double levels = Sensor({}, camera).levels_per_electron(exposure);
  const FrameImage first = image_of({.dark_offset_e = 100}, 0, 1), second = image_of({.dark_offset_e = 100}, 0, 2);
  EXPECT_NEAR(std::sqrt(moments(first).variance), 100 * levels, 5 * levels);
  for (int x = 0; x < 200; ++x) EXPECT_EQ(level(first, x, 7), level(second, x, 7));
  const FrameImage rows = image_of({.row_noise_e = 100}, 0, 1);
  for (int x = 1; x < 200; ++x) EXPECT_EQ(level(rows, x, 9), level(rows, 0, 9));
  EXPECT_NEAR(std::sqrt(moments(rows).variance), 100 * levels, 20 * levels) << "160 rows";
  EXPECT_NE(level(rows, 0, 9), level(image_of({.row_noise_e = 100}, 0, 2), 0, 9));
  int hot = 0;
  const FrameImage spots = image_of({.hot_pixel_fraction = 0.01}, 0, 1);
  for (int y = 0; y < 160; ++y) {
    for (int x = 0; x < 200; ++x) hot += level(spots, x, y) > 4095 * (1.0 / 64 + 0.09) ? 1 : 0;
  }
  EXPECT_NEAR(hot, 320, 60);
  const double signal = moments(image_of({}, 800, 1)).mean, plain = moments(image_of({}, 800, 1)).variance;
  const double patterned = moments(image_of({.pixel_response_percent = 5}, 800, 1)).variance;
  EXPECT_NEAR(std::sqrt(patterned - plain), 0.05 * (signal - 4095.0 / 64), 0.003 * signal);
}

TEST(Sensor, GainOfTheCameraScalesTheSignal) {
  const Camera camera = camera_of(64, 64, 12);
  const Exposure exposure{0.001, 1};
  const auto signal = [&](double gain) {
    const Sensor sensor({.vignetting = 0}, camera, {.gain = gain});
    return moments(sensor.expose(uniform(camera, 800), exposure, {}, 1, ThreadPool(1))).mean - 4095.0 / 64;
  };
  EXPECT_NEAR(signal(1.1) / signal(1), 1.1, 0.005);
}

// JPEG changes single pixels and keeps the mean; the better the quality, the smaller the change.
TEST(Sensor, JpegLosesFineDetail) {
  const Camera camera = camera_of(160, 160);
  const ThreadPool workers(1);
  const auto image_of = [&](int quality) {
    return Sensor({.jpeg_quality = quality}, camera).expose(uniform(camera, 800), {0.001, 1}, {}, 1, workers);
  };
  const FrameImage lossless = image_of(0);
  double before = 0;
  for (const int quality : {95, 80, 50}) {
    const FrameImage lossy = image_of(quality);
    double squares = 0;
    for (int y = 0; y < 160; ++y) {
      for (int x = 0; x < 160; ++x) squares += std::pow(level(lossy, x, y) - level(lossless, x, y), 2);
    }
    EXPECT_GT(squares, before) << quality;
    EXPECT_NEAR(moments(lossy).mean, moments(lossless).mean, 0.5);
    before = squares;
  }
}

// A textured image: noise of several pixels and an edge.
LuminanceImage textured(const Camera& camera) {
  LuminanceImage image = uniform(camera, 1000);
  Random random(5, 1);
  for (int y = 0; y < camera.size.height; ++y) {
    for (int x = 0; x < camera.size.width; ++x) {
      const double wave = std::sin(0.7 * x) * std::cos(0.45 * y) + (x > 60 ? 1.5 : 0);
      image.by_material[0](x, y) *= static_cast<float>(1 + 0.2 * wave + 0.05 * random.normal());
    }
  }
  return image;
}

double rms_difference(const FrameImage& a, const FrameImage& b) {
  double squares = 0;
  for (int y = 0; y < a.height(); ++y) {
    for (int x = 0; x < a.width(); ++x) squares += std::pow(level(a, x, y) - level(b, x, y), 2);
  }
  return std::sqrt(squares / (static_cast<double>(a.width()) * a.height()));
}

TEST(Sensor, FewerBitsOfTheWaveletsLoseMore) {
  const Camera camera = camera_of(128, 96);
  const LuminanceImage luminance = textured(camera);
  const auto expose = [&](double bits) {
    return Sensor({.wavelet_bits = bits}, camera).expose(luminance, {0.0005, 1}, {}, 1, ThreadPool(1));
  };
  const FrameImage lossless = expose(0);
  const double fine = rms_difference(expose(3), lossless), coarse = rms_difference(expose(0.5), lossless);
  EXPECT_GT(fine, 0.05);
  EXPECT_GT(coarse, 2 * fine);
  EXPECT_LT(coarse, 30);
  const FrameImage jpeg =
      Sensor({.jpeg_quality = 60, .wavelet_bits = 3}, camera).expose(luminance, {0.0005, 1}, {}, 1, ThreadPool(1));
  EXPECT_EQ(rms_difference(jpeg, expose(3)), 0) << "wavelets instead of JPEG";
}

TEST(Sensor, StatedVignettingIsThatOfTheImages) {
  const Camera camera = camera_of(240, 180);
  const SensorOptions options{.vignetting = 1, .read_noise_e = 0, .black_level = 0};
  const Image<float> image = Sensor(options, camera).noise_free(uniform(camera, 1000), {0.001, 1});
  const Vignetting stated = fitted_vignetting(camera, options.vignetting);
  const double centre = static_cast<double>(image(120, 90)), half_diagonal_squared = 0.25 * (240 * 240 + 180 * 180);
  for (const auto& [x, y] : {std::pair{0, 0}, std::pair{239, 0}, std::pair{60, 150}, std::pair{119, 20}}) {
    const double r = (Eigen::Vector2d(x, y) - *stated.centre_px).squaredNorm() / half_diagonal_squared;
    EXPECT_NEAR(stated.relative_illumination(r), static_cast<double>(image(x, y)) / centre, 0.003) << x << ' ' << y;
  }
}

}  // namespace
}  // namespace spartan::sim::internal
