#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "spartan/reconstruction/rendering.h"

namespace spartan {
namespace {

// From one quantile to another, at least `least_span` apart; 0 … 1 without values.
Range range_of(std::vector<float> values, double low_share, double high_share, double least_span) {
  if (values.empty()) return {};
  const auto quantile = [&](double share) {
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return static_cast<double>(*at);
  };
  const double low = quantile(low_share), high = quantile(high_share);
  return {low, std::max(high, low + least_span)};
}

template <typename Counts>
std::vector<float> values_where(ImageView<const float> image, const Counts& counts) {
  std::vector<float> values;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      if (std::isfinite(image(x, y)) && counts(x, y)) values.push_back(image(x, y));
    }
  }
  return values;
}

std::uint8_t level(double value) {
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(value, 0.0, 1.0)));
}

}  // namespace

Range disparity_colour_range(ImageView<const float> disparity) {
  return range_of(values_where(disparity, [](int, int) { return true; }), 0.01, 0.99, 1e-3);
}

Range elevation_colour_range(ImageView<const float> elevation_m, ImageView<const GroundClass> kind) {
  auto values = values_where(elevation_m, [&](int x, int y) { return kind(x, y) == GroundClass::ground; });
  if (values.empty()) values = values_where(elevation_m, [](int, int) { return true; });
  return range_of(std::move(values), 0.02, 0.98, 0.05);
}

Rgb8 disparity_colour(double value) {
  static const cv::Mat colours = [] {
    cv::Mat levels(256, 1, CV_8UC1), bgr;
    for (int i = 0; i < 256; ++i) levels.at<std::uint8_t>(i) = static_cast<std::uint8_t>(i);
    cv::applyColorMap(levels, bgr, cv::COLORMAP_TURBO);
    return bgr;
  }();
  const auto bgr = colours.at<cv::Vec3b>(static_cast<int>(std::clamp(value, 0.0, 1.0) * 255));
  return {bgr[2], bgr[1], bgr[0]};
}

Rgb8 elevation_colour(double value) {
  constexpr std::array<std::array<double, 3>, 5> kColours{
      {{0.0, 0.13, 0.30}, {0.26, 0.31, 0.42}, {0.49, 0.48, 0.47}, {0.74, 0.68, 0.42}, {1.0, 0.92, 0.27}}};
  const double at = std::clamp(value, 0.0, 1.0) * (kColours.size() - 1);
  const auto low = std::min(static_cast<std::size_t>(at), kColours.size() - 2);
  const double part = at - static_cast<double>(low);
  const auto mixed = [&](std::size_t i) { return level((1 - part) * kColours[low][i] + part * kColours[low + 1][i]); };
  return {mixed(0), mixed(1), mixed(2)};
}

}  // namespace spartan
