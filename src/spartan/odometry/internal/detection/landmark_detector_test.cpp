// What all detectors have in common.
#include "spartan/odometry/internal/detection/landmark_detector.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <opencv2/core/utility.hpp>
#include <string>

#include "spartan/numerics/gradient_noise.h"
#include "spartan/odometry/view_matching.h"

namespace spartan::internal {
namespace {

struct DetectorCase {
  std::string name;
  DetectorType type;
  bool upright, refine;
};

class AnyDetector : public ::testing::TestWithParam<DetectorCase> {
 protected:
  static DetectionOptions options(int landmarks = 300) {
    DetectionOptions o;
    o.detector = GetParam().type;
    o.landmarks = landmarks;
    o.surf.upright = o.harris.upright = GetParam().upright;
    o.surf.refine = GetParam().refine;
    return o;
  }
  static std::vector<Feature> detected(const DetectionOptions& o, const Image<std::uint8_t>& image,
                                       ImageView<const std::uint8_t> mask = {}, const WantedFeatures& wanted = {},
                                       int threads = 1) {
    return make_landmark_detector(o, ThreadPool(threads))->detect(image.view(), mask, wanted);
  }
};

Image<std::uint8_t> drawn_image(int width, int height, const std::function<double(double, double)>& gray) {
  Image<std::uint8_t> image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x)
      image(x, y) = static_cast<std::uint8_t>(std::lround(std::clamp(gray(x, y), 0.0, 255.0)));
  }
  return image;
}

const Image<std::uint8_t>& noise_texture() {
  static const Image<std::uint8_t> image = [] {
    const auto octaves = make_octaves(3, 5, 24, 0.8, 45);
    return drawn_image(360, 300, [&](double x, double y) {
      double value = 128;
      for (const auto& octave : octaves) value += octave.value(x, y);
      return value;
    });
  }();
  return image;
}

// Places of a grid, neither at whole pixels nor between two.
std::vector<Eigen::Vector2d> planted_places() {
  std::vector<Eigen::Vector2d> places;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) places.emplace_back(70.3 + 79.9 * column, 75.6 + 70.3 * row);
  return places;
}

// Dark and bright blobs for those that find blobs; corners of squares, antialiased, for the others.
Image<std::uint8_t> planted_image(bool blobs) {
  const std::vector<Eigen::Vector2d> places = planted_places();
  return drawn_image(381, 291, [&](double x, double y) {
    double value = 120;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const double dx = x - places[i].x(), dy = y - places[i].y(), height = i % 2 == 0 ? 90 : -90;
      if (blobs) {
        value += height * std::exp(-(dx * dx + dy * dy) / (2 * 3.5 * 3.5));
      } else {
        const auto inside = [](double d) { return std::clamp(d + 0.5, 0.0, 1.0) * std::clamp(24.5 - d, 0.0, 1.0); };
        value += height * inside(dx) * inside(dy);
      }
    }
    return value;
  });
}

TEST_P(AnyDetector, FindsWhatWasPlanted) {
  const bool blobs = GetParam().type != DetectorType::harris && GetParam().type != DetectorType::orb;
  const std::vector<Feature> found = detected(options(), planted_image(blobs));
  // A corner lies inside of its lines: the maximum of its response does.
  const double tolerance_px = blobs ? 0.15 : 3;
  for (const Eigen::Vector2d& place : planted_places()) {
    double nearest = 1e9;
    for (const Feature& f : found) nearest = std::min(nearest, std::hypot(f.x - place.x(), f.y - place.y()));
    EXPECT_LT(nearest, tolerance_px) << place.transpose();
  }
}

TEST_P(AnyDetector, KeepsCountSpacingOrderAndMask) {
  Image<std::uint8_t> mask(noise_texture().size());
  for (int y = 0; y < mask.height(); ++y)
    for (int x = 150; x < mask.width(); ++x) mask(x, y) = 255;
  DetectionOptions o = options(30);
  o.spacing_px = 9;
  const std::vector<Feature> found = detected(o, noise_texture(), mask.view());
  ASSERT_EQ(found.size(), 30U);
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_GE(found[i].x, 149.5F);
    EXPECT_GT(found[i].scale, 0);
    if (i > 0) {
      EXPECT_LE(found[i].strength, found[i - 1].strength);
    }
    for (std::size_t k = 0; k < i; ++k) EXPECT_GE(std::hypot(found[i].x - found[k].x, found[i].y - found[k].y), 9);
  }
  EXPECT_EQ(detected(o, noise_texture(), {}, {7, {}}).size(), 7U);
}

TEST_P(AnyDetector, KeepsAwayFromWhatIsTaken) {
  const std::vector<Feature> first = detected(options(40), noise_texture());
  std::vector<Eigen::Vector2f> taken;
  taken.reserve(first.size());
  for (const Feature& f : first) taken.emplace_back(f.x, f.y);
  const std::vector<Feature> more = detected(options(), noise_texture(), {}, {40, taken});
  ASSERT_GT(more.size(), 10U);
  for (const Feature& f : more)
    for (const Eigen::Vector2f& p : taken) EXPECT_GE(std::hypot(f.x - p.x(), f.y - p.y()), 5);
}

TEST_P(AnyDetector, IsIdenticalForAnyNumberOfThreadsAndCalls) {
  const int before = cv::getNumThreads();
  cv::setNumThreads(1);
  const std::vector<Feature> one = detected(options(), noise_texture(), {}, {}, 1);
  cv::setNumThreads(2);
  const auto detector = make_landmark_detector(options(), ThreadPool(2));
  for (int call = 0; call < 2; ++call) {
    const std::vector<Feature>& two = detector->detect(noise_texture().view(), {});
    ASSERT_EQ(one.size(), two.size());
    for (std::size_t i = 0; i < one.size(); ++i) {
      EXPECT_EQ(one[i].x, two[i].x);
      EXPECT_EQ(one[i].y, two[i].y);
      EXPECT_EQ(one[i].scale, two[i].scale);
      EXPECT_EQ(one[i].angle, two[i].angle);
      EXPECT_EQ(one[i].descriptor, two[i].descriptor);
    }
  }
  cv::setNumThreads(before);
}

// Its descriptors tell features of a slightly turned view apart.
TEST_P(AnyDetector, MatchesAView) {
  const double degrees = GetParam().upright ? 5 : 40;
  const TransformedView view = transform_view(noise_texture().view(), degrees * 0.01745, 1);
  FeatureComparisonOptions comparison;
  comparison.detection = options();
  comparison.repetitions = 1;
  FeatureComparison result =
      match_features(noise_texture().view(), view.image.view(), view.geometry, comparison, ThreadPool(1));
  score_features(view.geometry, 2, result);
  EXPECT_GT(result.correct, 25);
  EXPECT_GT(result.precision.value(), 0.7);
}

TEST_P(AnyDetector, FindsNothingInTinyOrFlatImages) {
  for (const auto& [width, height] :
       {std::pair(1, 1), {5, 40}, {10, 10}, {24, 24}, {32, 33}, {63, 64}, {80, 40}, {85, 300}, {200, 100}}) {
    EXPECT_TRUE(detected(options(), Image<std::uint8_t>(width, height, 77)).empty()) << width << " x " << height;
    const Image<std::uint8_t> textured =
        drawn_image(width, height, [](double x, double y) { return 128 + 100 * std::sin(x) * std::cos(y); });
    for (const Feature& f : detected(options(), textured)) {
      EXPECT_TRUE(f.x >= 0 && f.y >= 0 && f.x <= static_cast<float>(width - 1) && f.y <= static_cast<float>(height - 1))
          << width << " x " << height;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, AnyDetector,
                         ::testing::Values(DetectorCase{"surf", DetectorType::surf, true, false},
                                           DetectorCase{"surf_oriented", DetectorType::surf, false, false},
                                           DetectorCase{"surf_refined", DetectorType::surf, false, true},
                                           DetectorCase{"harris", DetectorType::harris, true, false},
                                           DetectorCase{"harris_oriented", DetectorType::harris, false, false},
                                           DetectorCase{"orb", DetectorType::orb, false, false},
                                           DetectorCase{"sift", DetectorType::sift, false, false},
                                           DetectorCase{"akaze", DetectorType::akaze, false, false}),
                         [](const ::testing::TestParamInfo<DetectorCase>& tested) { return tested.param.name; });

}  // namespace
}  // namespace spartan::internal
