#include "spartan/reconstruction/map_pictures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "spartan/core/opencv_bridge.h"

namespace spartan {
namespace {

constexpr Rgb8 kUnknown{30, 30, 34}, kObstacle{220, 50, 40}, kCavity{40, 90, 230}, kGround{70, 190, 80};

Rgb8 mixed(Rgb8 a, Rgb8 b, double part_of_b) {
  const auto mix = [&](std::uint8_t x, std::uint8_t y) {
    return static_cast<std::uint8_t>(std::lround((1 - part_of_b) * x + part_of_b * y));
  };
  return {mix(a.r, b.r), mix(a.g, b.g), mix(a.b, b.b)};
}

// Lambert's law for a sun 45° high in the north-west; the neighbours that are known give the slope.
std::uint8_t shade(ImageView<const float> z, int x, int y, double cell_m) {
  const auto rise = [&](int dx, int dy) {
    const bool before = z.contains(x - dx, y - dy) && std::isfinite(z(x - dx, y - dy)),
               behind = z.contains(x + dx, y + dy) && std::isfinite(z(x + dx, y + dy));
    const float low = before ? z(x - dx, y - dy) : z(x, y), high = behind ? z(x + dx, y + dy) : z(x, y);
    const int steps = (before ? 1 : 0) + (behind ? 1 : 0);
    return steps == 0 ? 0.0 : (high - low) / (steps * cell_m);
  };
  const double east = rise(1, 0), south = rise(0, 1);
  const double facing = (0.5 * east + 0.5 * south + std::sqrt(0.5)) / std::sqrt(1 + east * east + south * south);
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(0.05 + 1.05 * facing, 0.0, 1.0)));
}

// Column and row of the v-disparity image where a height over the plane stands straight ahead.
cv::Point place_of(const VDisparity& seen, const RectifiedStereo& g, double range_m, double height_m) {
  const double pitch = seen.plane.pitch_rad(), below = seen.plane.height_m - height_m;
  const double depth = range_m * std::cos(pitch) + below * std::sin(pitch),
               down = below * std::cos(pitch) - range_m * std::sin(pitch);
  const double far = std::max(depth, 1e-3);
  return {static_cast<int>(std::lround(g.focal_px * g.baseline_m / far / seen.bin_px)),
          static_cast<int>(std::lround(g.focal_px * down / far - seen.first_row_px))};
}

std::vector<cv::Point> curve_of(const VDisparity& seen, const RectifiedStereo& g, const GroundProfile& profile,
                                double over_m) {
  std::vector<cv::Point> curve;
  const double reach = 4.0 * std::max(seen.histogram.width(), seen.histogram.height());
  double range = profile.nearest_m;
  for (std::size_t i = 0; i < profile.height_m.size(); ++i, range *= GroundProfile::kRatio) {
    const cv::Point p = place_of(seen, g, range, profile.at(range) + over_m);
    if (std::abs(p.x) < reach && std::abs(p.y) < reach) curve.push_back(p);
  }
  return curve;
}

void draw_curve(cv::Mat& picture, const std::vector<cv::Point>& curve, Rgb8 colour) {
  if (curve.size() > 1) cv::polylines(picture, curve, false, cv::Scalar(colour.r, colour.g, colour.b), 1, cv::LINE_AA);
}

}  // namespace

Image<Rgb8> draw_map(ImageView<const float> elevation_m, ImageView<const float> kind, double cell_m, int scale) {
  Image<Rgb8> picture(elevation_m.width() * scale, elevation_m.height() * scale);
  for (int y = 0; y < elevation_m.height(); ++y) {
    for (int x = 0; x < elevation_m.width(); ++x) {
      Rgb8 colour = kUnknown;
      if (std::isfinite(elevation_m(x, y))) {
        const std::uint8_t light = shade(elevation_m, x, y, cell_m);
        colour = {light, light, light};
        if (kind(x, y) == 2) colour = mixed(colour, kObstacle, 0.6);
        if (kind(x, y) == 3) colour = mixed(colour, kCavity, 0.6);
      }
      for (int j = 0; j < scale; ++j) std::fill_n(picture.row(y * scale + j) + x * scale, scale, colour);
    }
  }
  return picture;
}

Image<Rgb8> draw_classes(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> classes) {
  Image<Rgb8> picture(left.size());
  for (int y = 0; y < left.height(); ++y) {
    for (int x = 0; x < left.width(); ++x) {
      const Rgb8 gray{left(x, y), left(x, y), left(x, y)};
      switch (static_cast<GroundClass>(classes(x, y))) {
        case GroundClass::unknown:
          picture(x, y) = gray;
          break;
        case GroundClass::ground:
          picture(x, y) = mixed(gray, kGround, 0.3);
          break;
        case GroundClass::obstacle:
          picture(x, y) = mixed(gray, kObstacle, 0.55);
          break;
        case GroundClass::cavity:
          picture(x, y) = mixed(gray, kCavity, 0.55);
          break;
      }
    }
  }
  return picture;
}

Image<Rgb8> draw_v_disparity(const VDisparity& seen, const RectifiedStereo& geometry,
                             const VDisparityOptions& options) {
  const Image<std::uint16_t>& histogram = seen.histogram;
  Image<Rgb8> picture(histogram.size());
  // A logarithm, so that a few pixels are seen beside many.
  const double most = std::log1p(histogram.width() > 0 ? 400.0 : 1.0);
  for (int y = 0; y < histogram.height(); ++y) {
    for (int x = 0; x < histogram.width(); ++x) {
      const auto level =
          static_cast<std::uint8_t>(std::lround(255 * std::min(1.0, std::log1p(histogram(x, y)) / most)));
      picture(x, y) = {level, level, level};
    }
  }
  cv::Mat mat = as_mat(picture);
  for (const GroundProfile& profile : seen.profiles)
    draw_curve(mat, curve_of(seen, geometry, profile, 0), {235, 205, 40});
  const GroundProfile& middle = seen.profiles[seen.profiles.size() / 2];
  draw_curve(mat, curve_of(seen, geometry, middle, options.obstacle_m), kObstacle);
  draw_curve(mat, curve_of(seen, geometry, middle, -options.cavity_m), kCavity);
  return picture;
}

Image<Rgb8> draw_coverage(ImageView<const std::uint8_t> views) {
  // Colours of single views; sets are their mean.
  constexpr std::array<Rgb8, 8> kColours{{{230, 80, 60},
                                          {80, 190, 80},
                                          {70, 110, 230},
                                          {235, 205, 60},
                                          {190, 90, 200},
                                          {80, 200, 210},
                                          {240, 150, 60},
                                          {150, 150, 150}}};
  Image<Rgb8> picture(views.size());
  for (int y = 0; y < views.height(); ++y) {
    for (int x = 0; x < views.width(); ++x) {
      int r = 0, g = 0, b = 0, count = 0;
      for (std::size_t i = 0; i < kColours.size(); ++i) {
        if ((views(x, y) >> i & 1U) == 0) continue;
        r += kColours[i].r;
        g += kColours[i].g;
        b += kColours[i].b;
        ++count;
      }
      picture(x, y) = count == 0 ? kUnknown
                                 : Rgb8{static_cast<std::uint8_t>(r / count), static_cast<std::uint8_t>(g / count),
                                        static_cast<std::uint8_t>(b / count)};
    }
  }
  return picture;
}

}  // namespace spartan
