#include "spartan/figures/plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <regex>
#include <string>

#include "spartan/figures/plot_layout.h"

namespace spartan {
namespace {

using internal::layout_of;
using internal::PlotLayout;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr Rgb8 kLineColour{200, 0, 0}, kGroundColour{0, 0, 200};

Plot plot_of(std::vector<double> x, std::vector<double> y) {
  Plot plot;
  plot.title = "title & more";
  plot.x_label = "time, s";
  plot.y_label = "error < bound, m";
  plot.lines = {{"rise", kLineColour, std::move(x), std::move(y)}};
  return plot;
}

TEST(PlotLayout, GrowsToTheRightAndUpwards) {
  const PlotLayout layout = layout_of(plot_of({0, 1, 2}, {0, 5, 10}), 10);
  EXPECT_LT(layout.px(0), layout.px(2));
  EXPECT_GT(layout.py(0), layout.py(10)) << "rows count downwards";
  EXPECT_GT(layout.px(0), layout.left);
  EXPECT_LT(layout.px(2), layout.left + layout.width);
}

TEST(PlotLayout, EqualAxesHaveOneScaleAndFitTheData) {
  Plot flat = plot_of({0, 300}, {0, 10}), tall = plot_of({0, 10}, {0, 300});
  flat.equal_axes = tall.equal_axes = true;
  for (const Plot* plot : {&flat, &tall}) {
    const PlotLayout layout = layout_of(*plot, 10);
    EXPECT_NEAR(layout.px(1) - layout.px(0), layout.py(0) - layout.py(1), 0.02);
    EXPECT_LE(layout.total_width, plot->width_px);
    EXPECT_LE(layout.total_height, plot->height_px + 1);
  }
  EXPECT_LT(layout_of(flat, 10).height, 200);
  EXPECT_LT(layout_of(tall, 10).width, 400);
}

TEST(PlotLayout, TicksAreRoundAndInside) {
  for (const double span : {1e-6, 0.3, 7.0, 5000.0}) {
    const Range range{0.1 * span, 1.1 * span};
    const auto ticks = internal::ticks_of(range, 6);
    EXPECT_GE(ticks.size(), 3U);
    EXPECT_LE(ticks.size(), 8U);
    for (const double tick : ticks) {
      EXPECT_GE(tick, range.low - 1e-9 * span);
      EXPECT_LE(tick, range.high + 1e-9 * span);
    }
    const double step = ticks[1] - ticks[0], power = std::pow(10, std::floor(std::log10(step) + 1e-9));
    EXPECT_NEAR(std::abs(step / power - 1) * std::abs(step / power - 2) * std::abs(step / power - 5), 0, 1e-6) << step;
  }
}

TEST(PlotLayout, AScaleBarTakesAtMostAThird) {
  for (const double width_m : {0.7, 3.0, 44.0, 900.0}) {
    Plot plot = plot_of({0, width_m}, {0, width_m});
    plot.equal_axes = true;
    const PlotLayout layout = layout_of(plot, 10);
    EXPECT_LE(internal::scale_bar_m(layout), layout.x.span() / 3 * 1.0001);
    EXPECT_GE(internal::scale_bar_m(layout), layout.x.span() / 15);
  }
}

TEST(PlotHtml, HasATitleALegendAndLabels) {
  const std::string html = to_html(plot_of({0, 1, 2}, {0, 5, 10}));
  EXPECT_THAT(html, HasSubstr("<figcaption>title &amp; more</figcaption>"));
  EXPECT_THAT(html, HasSubstr("error &lt; bound, m"));
  EXPECT_THAT(html, HasSubstr("data-layer=\"0\""));
  EXPECT_THAT(html, HasSubstr(">rise</button>"));
  EXPECT_THAT(html, HasSubstr("d=\"M0 -0L1 -5L2 -10\"")) << "in units of the axes, y down";
}

TEST(PlotHtml, LinesAreInterruptedWhereAValueIsMissing) {
  EXPECT_THAT(to_html(plot_of({0, 1, 2, 3, 4}, {1, 2, kNone, 4, 5})), HasSubstr("d=\"M0 -1L1 -2M3 -4L4 -5\""));
}

TEST(PlotHtml, LongLinesAreThinned) {
  std::vector<double> x(100'000), y(100'000, 1);
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = static_cast<double>(i);
  EXPECT_LT(to_html(plot_of(std::move(x), std::move(y))).size(), 100'000U);
}

TEST(PlotHtml, APlotWithoutPointsIsStillAPlot) {
  for (const bool with_line : {false, true}) {
    const std::string html = to_html(with_line ? plot_of({kNone}, {1}) : Plot());
    EXPECT_THAT(html, HasSubstr("class=\"chart\""));
    EXPECT_THAT(html, Not(HasSubstr("nan")));
    EXPECT_THAT(html, Not(HasSubstr("inf")));
  }
}

TEST(PlotHtml, AMapHasAnImageAScaleBarAColourBarAndMarkers) {
  Plot plot = plot_of({0, 4}, {0, 2});
  plot.equal_axes = true;
  plot.image = PlotImage{"elevation", Image<Rgb8>(4, 2), {0, 4}, {0, 2}};
  plot.colour_bar = ColourBar{"elevation, m", {-1, 1}, [](double v) { return v < 0.5 ? kGroundColour : kLineColour; }};
  plot.markers = {
      {"rover", kGroundColour, 1, 1, 0.5}, {"stop", kLineColour, 2, 1, {}}, {"stop", kLineColour, 3, 1, {}}};
  plot.keys = {{"obstacle", kLineColour}};
  const std::string html = to_html(plot);
  EXPECT_THAT(html, HasSubstr("<image data-layer=\"3\" x=\"0\" y=\"-2\" width=\"4\" height=\"2\""));
  EXPECT_THAT(html, HasSubstr("class=\"scale\""));
  EXPECT_THAT(html, HasSubstr("class=\"bar\""));
  EXPECT_THAT(html, HasSubstr(">obstacle</span>"));
  for (const char* key : {"data-layer=\"1\"><svg", "data-layer=\"2\"><svg", "data-layer=\"3\"><svg"})
    EXPECT_THAT(html, HasSubstr(key)) << "one entry for the rover, one for both stops, one for the image";
  EXPECT_THAT(html, Not(HasSubstr("data-layer=\"4\"")));
}

TEST(PlotImage, HasItsPartsWhereTheLayoutPutsThem) {
  Plot plot = plot_of({1, 1}, {0.5, 1.5});
  plot.equal_axes = true;
  plot.lines[0].width_px = 6;
  plot.image = PlotImage{"ground", Image<Rgb8>(4, 2, kGroundColour), {0, 4}, {0, 2}};
  const PlotLayout layout = layout_of(plot, 54);
  const Image<Rgb8> image = to_image(plot);
  EXPECT_EQ(image.width(), static_cast<int>(std::lround(layout.total_width)));
  const auto at = [&](double x, double y) {
    return image(static_cast<int>(layout.px(x)), static_cast<int>(layout.py(y)));
  };
  EXPECT_EQ(at(1, 1).r, kLineColour.r);
  EXPECT_EQ(at(3, 1).b, kGroundColour.b);
  EXPECT_EQ(at(3, 1).r, kGroundColour.r);
}

}  // namespace
}  // namespace spartan
