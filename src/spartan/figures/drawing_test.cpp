#include "spartan/figures/drawing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <utility>

namespace spartan {
namespace {

using ::testing::HasSubstr;

constexpr Rgb8 kRed{200, 0, 0}, kBlue{0, 0, 200};

bool is_near(const Rgb8& a, const Rgb8& b) {
  return std::abs(a.r - b.r) < 8 && std::abs(a.g - b.g) < 8 && std::abs(a.b - b.b) < 8;
}

Drawing two_squares() {
  Drawing drawing(60, 40);
  drawing.fill({{10, 10}, {40, 10}, {40, 30}, {10, 30}}, {kRed});
  drawing.fill({{20, 15}, {30, 15}, {30, 25}, {20, 25}}, {kBlue});
  return drawing;
}

TEST(Drawing, LaterPartsCoverEarlierOnes) {
  const Image<Rgb8> image = two_squares().to_image();
  ASSERT_EQ(image.view().size(), (ImageSize{60, 40}));
  EXPECT_TRUE(is_near(image(12, 12), kRed));
  EXPECT_TRUE(is_near(image(25, 20), kBlue));
  EXPECT_TRUE(is_near(image(55, 35), {255, 255, 255}));
}

TEST(Drawing, TheSvgHoldsTheSameParts) {
  const std::string svg = two_squares().to_svg();
  EXPECT_THAT(svg, HasSubstr("10.00,10.00 40.00,10.00 40.00,30.00 10.00,30.00"));
  EXPECT_LT(svg.find("#c80000"), svg.find("#0000c8")) << "in the order of the parts";
}

TEST(Drawing, OpacityMixesWithWhatLiesBelow) {
  Drawing drawing(20, 20);
  drawing.fill({{0, 0}, {20, 0}, {20, 20}, {0, 20}}, {kBlue, 0.5});
  EXPECT_TRUE(is_near(drawing.to_image()(10, 10), {127, 127, 227}));
}

TEST(Drawing, DashesLeaveGaps) {
  Drawing solid(100, 10), dashed(100, 10);
  solid.line({{0, 5}, {100, 5}}, {kRed, 3});
  dashed.line({{0, 5}, {100, 5}}, {kRed, 3, 10});
  const auto painted = [](const Drawing& drawing) {
    const Image<Rgb8> image = drawing.to_image();
    int count = 0;
    for (int x = 0; x < image.width(); ++x) count += is_near(image(x, 5), kRed) ? 1 : 0;
    return count;
  };
  EXPECT_GE(painted(solid), 98);
  EXPECT_NEAR(painted(dashed), 50, 10);
}

TEST(Drawing, TextIsEscapedAndAnchored) {
  Drawing drawing(200, 40);
  drawing.text({190, 30}, "1 < 2 & 3", {kBlue, 14, Anchor::end});
  const std::string svg = drawing.to_svg();
  EXPECT_THAT(svg, HasSubstr("1 &lt; 2 &amp; 3"));
  EXPECT_THAT(svg, HasSubstr("text-anchor=\"end\""));
}

TEST(Drawing, ImagesFillTheirRectangle) {
  Image<Rgb8> pixels(2, 1);
  pixels(0, 0) = kRed;
  pixels(1, 0) = kBlue;
  Drawing drawing(60, 40);
  drawing.image({10, 10}, {50, 30}, std::move(pixels));
  const Image<Rgb8> image = drawing.to_image();
  EXPECT_TRUE(is_near(image(12, 12), kRed));
  EXPECT_TRUE(is_near(image(28, 28), kRed));
  EXPECT_TRUE(is_near(image(32, 12), kBlue));
  EXPECT_TRUE(is_near(image(52, 20), {255, 255, 255}));
  EXPECT_THAT(drawing.to_svg(), HasSubstr("href=\"data:image/png;base64,"));
}

}  // namespace
}  // namespace spartan
