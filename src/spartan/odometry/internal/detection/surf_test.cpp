#include "spartan/odometry/internal/detection/surf.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "spartan/numerics/gradient_noise.h"

namespace spartan::internal {
namespace {

Image<std::uint8_t> rendered(int width, int height, const std::function<double(double, double)>& gray) {
  Image<std::uint8_t> image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x)
      image(x, y) = static_cast<std::uint8_t>(std::lround(std::clamp(gray(x, y), 0.0, 255.0)));
  }
  return image;
}

Image<std::uint8_t> blob(double x0, double y0, double sigma, double height) {
  return rendered(121, 101, [=](double x, double y) {
    return 120 + height * std::exp(-((x - x0) * (x - x0) + (y - y0) * (y - y0)) / (2 * sigma * sigma));
  });
}

// A texture under a similarity: image(x) = texture(R(−angle) (x − centre) / zoom).
Image<std::uint8_t> texture(double angle, double zoom) {
  const auto octaves = make_octaves(3, 3, 24, 0.7, 45);
  const double c = std::cos(angle), s = std::sin(angle);
  return rendered(320, 320, [=](double x, double y) {
    const double dx = (x - 159.5) / zoom, dy = (y - 159.5) / zoom;
    double value = 128;
    for (const auto& octave : octaves) value += octave.value(c * dx + s * dy, c * dy - s * dx);
    return value;
  });
}

// The side of the filter (as a real number) with the largest determinant at the centre of a Gaussian blob, in closed
// form: boxes over a Gaussian are products of error functions.
double best_filter(double sigma) {
  const auto integral = [&](double half) { return 2 * std::erf(half / (std::sqrt(2.0) * sigma)); };
  double best = 0, best_side = 0;
  for (double side = 6; side < 100; side += 0.05) {
    const double lobe = side / 3;
    const double xx = (integral(side / 2) - 3 * integral(lobe / 2)) * integral(lobe - 0.5) / (side * side);
    if (xx * xx > best) {
      best = xx * xx;
      best_side = side;
    }
  }
  return best_side;
}

DetectionOptions few() {
  DetectionOptions options;
  options.landmarks = 300;
  return options;
}

TEST(Surf, FindsPositionScaleAndSignOfABlob) {
  for (const double sigma : {3.0, 3.5, 4.5, 6.0, 8.0}) {
    for (const double height : {90.0, -90.0}) {
      SurfDetector detector(few(), ThreadPool(1));
      const std::vector<Feature>& found = detector.detect(blob(60.3, 49.6, sigma, height), {});
      ASSERT_FALSE(found.empty()) << sigma;
      const Feature& f = found.front();
      EXPECT_NEAR(f.x, 60.3, 0.25) << sigma;
      EXPECT_NEAR(f.y, 49.6, 0.25) << sigma;
      EXPECT_NEAR(f.scale / (best_filter(sigma) * 1.2 / 9), 1.0, 0.06) << sigma;
      EXPECT_EQ(f.sign, height > 0 ? -1 : 1);
    }
  }
}

TEST(Surf, BoxHessianHasTheSignsOfTheSecondDerivatives) {
  IntegralImage integral;
  integral.compute(rendered(
      61, 61, [](double x, double y) { return 60 + 0.05 * (x - 30) * (x - 30) + 0.02 * (y - 30) * (y - 30); }));
  const BoxHessian bowl = box_hessian(integral, 30, 30, 15);
  EXPECT_GT(bowl.xx, 0);
  EXPECT_NEAR(bowl.xx / bowl.yy, 2.5, 0.2);
  EXPECT_NEAR(bowl.xy, 0, 0.05 * bowl.xx);
  integral.compute(rendered(61, 61, [](double x, double y) { return 120 + 0.1 * (x - 30) * (y - 30); }));
  const BoxHessian saddle = box_hessian(integral, 30, 30, 15);
  EXPECT_GT(std::abs(saddle.xy), 20 * std::abs(saddle.xx));
  EXPECT_LT(saddle.determinant(), 0);
}

// Fraction of the features of `a` that `b` has at the transformed position (repeatability), and for which that feature
// has the nearest descriptor.
struct Repeatability {
  double found = 0, matched = 0;
};
Repeatability repeatability_of(bool upright, double angle, double zoom, bool refine = false) {
  DetectionOptions options = few();
  options.surf.upright = upright;
  options.surf.refine = refine;
  SurfDetector detector(options, ThreadPool(1));
  const std::vector<Feature> a = detector.detect(texture(0, 1), {});
  const std::vector<Feature> b = detector.detect(texture(angle, zoom), {});
  int inside = 0, found = 0, matched = 0;
  for (const Feature& f : a) {
    const double dx = f.x - 159.5, dy = f.y - 159.5;
    const double x = 159.5 + zoom * (std::cos(angle) * dx - std::sin(angle) * dy);
    const double y = 159.5 + zoom * (std::sin(angle) * dx + std::cos(angle) * dy);
    if (x < 50 || y < 50 || x > 270 || y > 270) continue;
    ++inside;
    const auto near = [&](const Feature& g) {
      return std::hypot(g.x - x, g.y - y) < 1.5 && g.scale > 0.7 * zoom * f.scale && g.scale < 1.4 * zoom * f.scale;
    };
    found += std::any_of(b.begin(), b.end(), near);
    const auto best = std::min_element(b.begin(), b.end(), [&](const Feature& g, const Feature& h) {
      return squared_distance(f.descriptor, g.descriptor) < squared_distance(f.descriptor, h.descriptor);
    });
    matched += near(*best);
  }
  return {static_cast<double>(found) / inside, static_cast<double>(matched) / inside};
}

TEST(Surf, IsRepeatableUnderSmallZoomAndRotation) {
  const Repeatability repeated = repeatability_of(true, 0.1, 1.1);
  EXPECT_GT(repeated.found, 0.6);
  EXPECT_GT(repeated.matched, 0.5);
}

TEST(Surf, IsRepeatableUnderLargeRotationWithOrientation) {
  const Repeatability oriented = repeatability_of(false, 1.2, 1.0), upright = repeatability_of(true, 1.2, 1.0);
  EXPECT_GT(oriented.found, 0.6);
  EXPECT_GT(oriented.matched, 0.5);
  EXPECT_LT(upright.matched, 0.2);  // without orientation
}

TEST(Surf, IsMoreRepeatableWithRefinement) {
  for (const auto& [angle, zoom] : {std::pair(0.785, 1.0), {0.0, 0.7}, {0.0, 1.4}}) {
    const Repeatability plain = repeatability_of(false, angle, zoom),
                        refined = repeatability_of(false, angle, zoom, true);
    EXPECT_GT(refined.found, plain.found) << angle << " " << zoom;
    EXPECT_GT(refined.matched, plain.matched) << angle << " " << zoom;
  }
}

// The determinant of the Hessian of a Gaussian blob of σ, smoothed by a Gaussian of s, is largest at s = σ (Lindeberg).
TEST(SurfRefinement, FindsPositionAndScaleOfABlobFromAPoorStart) {
  for (const double sigma : {2.0, 3.0, 4.5, 6.0}) {
    const Image<std::uint8_t> image = rendered(221, 201, [=](double x, double y) {
      return 120 + 90 * std::exp(-((x - 110.3) * (x - 110.3) + (y - 99.6) * (y - 99.6)) / (2 * sigma * sigma));
    });
    SurfRefinement refinement;
    refinement.compute(image.view());
    Feature start;
    start.x = 110.3F + static_cast<float>(0.7 * sigma);
    start.y = 99.6F - static_cast<float>(0.5 * sigma);
    start.scale = static_cast<float>(0.8 * sigma);
    const std::optional<Feature> refined = refinement.refined(start);
    ASSERT_TRUE(refined.has_value()) << sigma;
    EXPECT_NEAR(refined->x, 110.3, 0.04) << sigma;
    EXPECT_NEAR(refined->y, 99.6, 0.04) << sigma;
    EXPECT_NEAR(refined->scale / sigma, 1, 0.07) << sigma;
  }
}

TEST(SurfRefinement, FindsNothingWhereThereIsNoBlob) {
  const Image<std::uint8_t> saddle =
      rendered(121, 101, [](double x, double y) { return 120 + 0.03 * (x - 60) * (y - 50); });
  SurfRefinement refinement;
  refinement.compute(saddle.view());
  Feature start;
  start.x = 60;
  start.y = 50;
  start.scale = 3;
  EXPECT_FALSE(refinement.refined(start).has_value());
  const Image<std::uint8_t> at_border = blob(10, 50, 3, 90);
  refinement.compute(at_border.view());
  start.x = 10;
  EXPECT_FALSE(refinement.refined(start).has_value());
}

TEST(Surf, OrientationFollowsTheImage) {
  for (const double turn : {0.0, 0.4, 0.785, 1.6, 3.0, -2.0}) {
    IntegralImage integral;
    integral.compute(rendered(121, 121, [=](double x, double y) {
      return 128 + 1.5 * ((x - 60) * std::cos(turn) + (y - 60) * std::sin(turn));
    }));
    Feature f;
    f.x = f.y = 60;
    f.scale = 2;
    EXPECT_NEAR(std::remainder(surf_orientation(integral, f) - turn, 2 * 3.14159265), 0, 0.03) << turn;
  }
}

TEST(Surf, DescriptorIsInvariantToBrightnessAndContrast) {
  const Image<std::uint8_t> plain = texture(0, 1);
  const Image<std::uint8_t> dull = rendered(
      320, 320, [&](double x, double y) { return 90 + 0.5 * plain(static_cast<int>(x), static_cast<int>(y)); });
  IntegralImage a, b;
  a.compute(plain);
  b.compute(dull);
  Feature f;
  f.x = 150;
  f.y = 160;
  f.scale = 2;
  EXPECT_LT(std::sqrt(squared_distance(surf_descriptor(a, f), surf_descriptor(b, f))), 0.05);
}

TEST(Surf, IsIdenticalForAnyNumberOfThreads) {
  const Image<std::uint8_t> image = texture(0.3, 1);
  SurfDetector one(few(), ThreadPool(1)), two(few(), ThreadPool(2));
  const std::vector<Feature>& a = one.detect(image, {});
  const std::vector<Feature>& b = two.detect(image, {});
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].x, b[i].x);
    EXPECT_EQ(a[i].y, b[i].y);
    EXPECT_EQ(a[i].descriptor, b[i].descriptor);
  }
}

TEST(Surf, RespectsMaskCountAndOrder) {
  const Image<std::uint8_t> image = texture(0, 1);
  Image<std::uint8_t> mask(320, 320);
  for (int y = 0; y < 320; ++y)
    for (int x = 160; x < 320; ++x) mask(x, y) = 255;
  DetectionOptions options = few();
  options.landmarks = 50;
  SurfDetector detector(options, ThreadPool(1));
  const std::vector<Feature>& found = detector.detect(image, mask);
  ASSERT_EQ(found.size(), 50u);
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_GE(found[i].x, 159.5f);
    if (i > 0) {
      EXPECT_LE(found[i].strength, found[i - 1].strength);
    }
  }
}

TEST(Surf, FindsNothingInTinyOrFlatImages) {
  SurfDetector detector(few(), ThreadPool(1));
  for (const auto& [width, height] : {std::pair(1, 1), {5, 40}, {10, 10}, {24, 24}, {200, 100}}) {
    EXPECT_TRUE(detector.detect(Image<std::uint8_t>(width, height, 77), {}).empty());
  }
}

}  // namespace
}  // namespace spartan::internal
