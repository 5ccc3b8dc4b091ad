#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "spartan/image_io/opencv_bridge.h"
#include "spartan/reconstruction/rendering.h"

namespace spartan {
namespace {

constexpr Rgb8 kUnknown = kUnknownColour, kObstacle = kObstacleColour, kCavity = kCavityColour, kGround = kGroundColour;

constexpr double kLevelLight = 0.05 + 1.05 * 0.7071;

Rgb8 mixed(Rgb8 a, Rgb8 b, double fraction_of_b) {
  const auto mix = [&](std::uint8_t x, std::uint8_t y) {
    return static_cast<std::uint8_t>(std::lround((1 - fraction_of_b) * x + fraction_of_b * y));
  };
  return {mix(a.r, b.r), mix(a.g, b.g), mix(a.b, b.b)};
}

// Lambertian shading by a light source 45° high in the upper left, about 0.8 on level ground; the slope comes from the
// known neighbours.
double shade(ImageView<const float> z, int x, int y, double cell_m) {
  const auto rise = [&](int dx, int dy) {
    const bool before = z.contains(x - dx, y - dy) && std::isfinite(z(x - dx, y - dy)),
               behind = z.contains(x + dx, y + dy) && std::isfinite(z(x + dx, y + dy));
    const float low = before ? z(x - dx, y - dy) : z(x, y), high = behind ? z(x + dx, y + dy) : z(x, y);
    const int steps = (before ? 1 : 0) + (behind ? 1 : 0);
    return steps == 0 ? 0.0 : (high - low) / (steps * cell_m);
  };
  const double east = rise(1, 0), south = rise(0, 1);
  const double facing = (0.5 * east + 0.5 * south + std::sqrt(0.5)) / std::sqrt(1 + east * east + south * south);
  return std::clamp(0.05 + 1.05 * facing, 0.0, 1.0);
}

// Level ground keeps its colour.
Rgb8 lit(const Rgb8& colour, double light) {
  const auto scaled = [&](std::uint8_t v) {
    return static_cast<std::uint8_t>(std::clamp(std::lround(v * light / kLevelLight), 0L, 255L));
  };
  return {scaled(colour.r), scaled(colour.g), scaled(colour.b)};
}

// Column and row in the v-disparity image of a point straight ahead at a range and a height above the plane.
cv::Point pixel_of(const VDisparity& v_disparity, const RectifiedStereo& g, double range_m, double height_m) {
  const double pitch = v_disparity.plane.pitch_rad(), below = v_disparity.plane.height_m - height_m;
  const double depth = range_m * std::cos(pitch) + below * std::sin(pitch),
               down = below * std::cos(pitch) - range_m * std::sin(pitch);
  const double far = std::max(depth, 1e-3);
  return {static_cast<int>(std::lround(g.focal_px * g.baseline_m / far / v_disparity.bin_px)),
          static_cast<int>(std::lround(g.focal_px * down / far - v_disparity.first_row_px))};
}

std::vector<cv::Point> curve_of(const VDisparity& v_disparity, const RectifiedStereo& g, const GroundProfile& profile,
                                double over_m) {
  std::vector<cv::Point> curve;
  const double reach = 4.0 * std::max(v_disparity.histogram.width(), v_disparity.histogram.height());
  double range = profile.nearest_m;
  for (std::size_t i = 0; i < profile.height_m.size(); ++i, range *= GroundProfile::kRatio) {
    const cv::Point p = pixel_of(v_disparity, g, range, profile.at(range) + over_m);
    if (std::abs(p.x) < reach && std::abs(p.y) < reach) curve.push_back(p);
  }
  return curve;
}

void draw_curve(cv::Mat& image, const std::vector<cv::Point>& curve, Rgb8 colour) {
  if (curve.size() > 1) cv::polylines(image, curve, false, cv::Scalar(colour.r, colour.g, colour.b), 1, cv::LINE_AA);
}

}  // namespace

Image<Rgb8> render_map(ImageView<const float> elevation_m, ImageView<const GroundClass> kind, double cell_m,
                       const Range& range_m) {
  Image<Rgb8> image(elevation_m.size());
  for (int y = 0; y < elevation_m.height(); ++y) {
    for (int x = 0; x < elevation_m.width(); ++x) {
      Rgb8 colour = kUnknown;
      if (std::isfinite(elevation_m(x, y))) {
        const double light = shade(elevation_m, x, y, cell_m);
        switch (kind(x, y)) {
          case GroundClass::obstacle:  // steep, but to be seen as red also in the shade
            colour = lit(kObstacle, 0.5 * (kLevelLight + light));
            break;
          case GroundClass::cavity:
            colour = lit(kCavity, 0.5 * (kLevelLight + light));
            break;
          default:
            colour = lit(elevation_colour((elevation_m(x, y) - range_m.low) / range_m.span()), light);
        }
      }
      image(x, y) = colour;
    }
  }
  return image;
}

Image<Rgb8> render_classes(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> classes) {
  Image<Rgb8> image(left.size());
  for (int y = 0; y < left.height(); ++y) {
    for (int x = 0; x < left.width(); ++x) {
      const Rgb8 gray{left(x, y), left(x, y), left(x, y)};
      switch (static_cast<GroundClass>(classes(x, y))) {
        case GroundClass::unknown:
          image(x, y) = gray;
          break;
        case GroundClass::ground:
          image(x, y) = mixed(gray, kGround, 0.3);
          break;
        case GroundClass::obstacle:
          image(x, y) = mixed(gray, kObstacle, 0.55);
          break;
        case GroundClass::cavity:
          image(x, y) = mixed(gray, kCavity, 0.55);
          break;
      }
    }
  }
  return image;
}

Image<Rgb8> render_v_disparity(const VDisparity& v_disparity, const RectifiedStereo& geometry,
                               const VDisparityOptions& options) {
  const Image<std::uint16_t>& histogram = v_disparity.histogram;
  Image<Rgb8> image(histogram.size());
  // Logarithmic scale, so that bins of few pixels are visible beside bins of many.
  const double most = std::log1p(histogram.width() > 0 ? 400.0 : 1.0);
  for (int y = 0; y < histogram.height(); ++y) {
    for (int x = 0; x < histogram.width(); ++x) {
      const auto level =
          static_cast<std::uint8_t>(std::lround(255 * std::min(1.0, std::log1p(histogram(x, y)) / most)));
      image(x, y) = {level, level, level};
    }
  }
  cv::Mat mat = as_mat(image);
  for (const GroundProfile& profile : v_disparity.profiles)
    draw_curve(mat, curve_of(v_disparity, geometry, profile, 0), kGroundProfileColour);
  const GroundProfile& middle = v_disparity.profiles[v_disparity.profiles.size() / 2];
  draw_curve(mat, curve_of(v_disparity, geometry, middle, options.obstacle_m), kObstacle);
  draw_curve(mat, curve_of(v_disparity, geometry, middle, -options.cavity_m), kCavity);
  return image;
}

Rgb8 view_colour(std::size_t view) {
  constexpr std::array<Rgb8, 8> kColours{{{230, 80, 60},
                                          {80, 190, 80},
                                          {70, 110, 230},
                                          {235, 205, 60},
                                          {190, 90, 200},
                                          {80, 200, 210},
                                          {240, 150, 60},
                                          {150, 150, 150}}};
  return kColours[view % kColours.size()];
}

Image<Rgb8> render_view_coverage(ImageView<const std::uint8_t> views) {
  Image<Rgb8> image(views.size());
  for (int y = 0; y < views.height(); ++y) {
    for (int x = 0; x < views.width(); ++x) {
      int r = 0, g = 0, b = 0, count = 0;
      for (std::size_t i = 0; i < 8; ++i) {
        if ((views(x, y) >> i & 1U) == 0) continue;
        const Rgb8 colour = view_colour(i);
        r += colour.r;
        g += colour.g;
        b += colour.b;
        ++count;
      }
      image(x, y) = count == 0 ? kUnknown
                               : Rgb8{static_cast<std::uint8_t>(r / count), static_cast<std::uint8_t>(g / count),
                                      static_cast<std::uint8_t>(b / count)};
    }
  }
  return image;
}

}  // namespace spartan
