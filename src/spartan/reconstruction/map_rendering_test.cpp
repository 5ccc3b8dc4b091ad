#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "spartan/reconstruction/rendering.h"
#include "spartan/rig/rig.h"
#include "spartan/testing/height_field_view.h"

namespace spartan {
namespace {

bool same(Rgb8 a, Rgb8 b) {
  return a.r == b.r && a.g == b.g && a.b == b.b;
}

double luminance(const Rgb8& c) {
  return 0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b;
}

TEST(MapRendering, ElevationColoursGrowBrighterInEvenSteps) {
  for (int i = 0; i < 10; ++i) {
    const double step = luminance(elevation_colour(0.1 * (i + 1))) - luminance(elevation_colour(0.1 * i));
    EXPECT_GT(step, 10) << i;
    EXPECT_LT(step, 35) << i;
  }
  EXPECT_EQ(elevation_colour(2), elevation_colour(1));
}

TEST(MapRendering, DisparityColoursRunFromBlueOverGreenToRed) {
  EXPECT_GT(disparity_colour(0.1).b, disparity_colour(0.1).r);
  EXPECT_GT(disparity_colour(0.5).g, disparity_colour(0.5).r);
  EXPECT_GT(disparity_colour(0.95).r, disparity_colour(0.95).b + 50);
}

TEST(MapRendering, SlopesTowardsTheLightAreBrighterAndUnknownCellsAreLight) {
  Image<float> elevation(9, 3);
  Image<GroundClass> kind(9, 3, GroundClass::ground);
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 9; ++x) elevation(x, y) = 0.02F * static_cast<float>(std::min(x, 8 - x));
  }
  elevation(8, 0) = std::numeric_limits<float>::quiet_NaN();
  kind(4, 1) = GroundClass::obstacle;
  kind(2, 1) = GroundClass::cavity;
  const Image<Rgb8> image = render_map(elevation, kind, 0.05, elevation_colour_range(elevation, kind));
  EXPECT_EQ(image.width(), 9);
  const auto at = [&](int x, int y) { return image(x, y); };
  EXPECT_GT(at(1, 1).g, at(7, 1).g) << "the light comes from the upper left";
  EXPECT_GT(at(8, 0).g, 200);
  EXPECT_GT(at(4, 1).r, at(4, 1).b + 50) << "an obstacle is red";
  EXPECT_GT(at(2, 1).b, at(2, 1).r + 50) << "a cavity is blue";
}

TEST(MapRendering, ClassesTintTheImage) {
  const Image<std::uint8_t> left(4, 1, 100);
  Image<std::uint8_t> classes(4, 1);
  for (int x = 0; x < 4; ++x) classes(x, 0) = static_cast<std::uint8_t>(x);
  const Image<Rgb8> image = render_classes(left, classes);
  EXPECT_TRUE(same(image(0, 0), {100, 100, 100}));
  EXPECT_GT(image(1, 0).g, image(1, 0).r);
  EXPECT_GT(image(2, 0).r, image(2, 0).g);
  EXPECT_GT(image(3, 0).b, image(3, 0).r);
}

TEST(MapRendering, EachSetOfViewsHasItsOwnColour) {
  Image<std::uint8_t> views(4, 1);
  for (int x = 0; x < 4; ++x) views(x, 0) = static_cast<std::uint8_t>(x);
  const Image<Rgb8> image = render_view_coverage(views);
  for (int a = 0; a < 4; ++a) {
    for (int b = 0; b < a; ++b) EXPECT_FALSE(same(image(a, 0), image(b, 0)));
  }
}

// On level ground the yellow profile coincides with the bright line of the v-disparity image in every row.
TEST(MapRendering, TheProfileCoincidesWithTheGroundLine) {
  const RectifiedStereo stereo{{120, 120}, 130, {59.5, 59.5}, 0.2};
  const Pose body_from_left = testing::camera_pose_at(1, 0, 0.68, optical_from_forward());
  const Image<float> disparity = testing::disparity_of([](double, double) { return 0.0; }, stereo, body_from_left);
  const GroundPlane expected{body_from_left.rotation().conjugate() * Eigen::Vector3d::UnitZ(), 1};
  const auto seen = compute_v_disparity(disparity, stereo, expected, {}, ThreadPool(1));
  ASSERT_TRUE(seen);
  const Image<Rgb8> image = render_v_disparity(*seen, stereo, {});
  EXPECT_EQ(image.size(), seen->histogram.size());
  int near = 0, rows = 0;
  for (int y = 30; y + 4 < image.height(); ++y) {  // in higher rows the threshold lines cover the profile
    int line = -1, yellow = -1;
    for (int x = 0; x < image.width(); ++x) {
      if (seen->histogram(x, y) > 0 && (line < 0 || seen->histogram(x, y) > seen->histogram(line, y))) line = x;
      if (image(x, y).r > 150 && image(x, y).g > 130 && image(x, y).b < 120) yellow = x;
    }
    if (line < 0) continue;
    ++rows;
    near += std::abs(line - yellow) <= 1 ? 1 : 0;
  }
  EXPECT_GT(rows, 70);
  EXPECT_GT(near, 0.9 * rows);
}

}  // namespace
}  // namespace spartan
