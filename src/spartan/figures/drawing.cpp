#include "spartan/figures/drawing.h"

#include <fmt/format.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "spartan/figures/colours.h"
#include "spartan/figures/html.h"
#include "spartan/image_io/opencv_bridge.h"

namespace spartan {
namespace {

using Points = Drawing::Points;

std::string svg_points(const Points& points) {
  std::string text;
  for (const Eigen::Vector2d& p : points) text += fmt::format("{}{:.2f},{:.2f}", text.empty() ? "" : " ", p.x(), p.y());
  return text;
}

// --- pixels ---

// Everything is painted so many times too large and then shrunk: smooth borders for areas as for lines.
constexpr int kOversampling = 3;
constexpr int kShift = 4;  // OpenCV takes points as fixed-point numbers with so many binary digits
constexpr const char* kDegreeSign = "°";
constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
// Letter heights of the stroke font at scale 1, px; a letter's size counts from descender to ascender.
constexpr double kCapitals_px = 21, kCapitalsOfSize = 0.68;

cv::Scalar scalar(const Rgb8& c) {
  return {static_cast<double>(c.r), static_cast<double>(c.g), static_cast<double>(c.b)};
}

std::vector<cv::Point> fixed_point(const Points& points) {
  std::vector<cv::Point> fixed;
  fixed.reserve(points.size());
  constexpr double kScale = kOversampling * (1 << kShift);
  for (const Eigen::Vector2d& p : points) fixed.emplace_back(cvRound(p.x() * kScale), cvRound(p.y() * kScale));
  return fixed;
}

void paint_area(cv::Mat& canvas, const Points& corners, const Paint& paint) {
  if (corners.size() < 3) return;
  const std::vector<std::vector<cv::Point>> outline{fixed_point(corners)};
  if (paint.opacity >= 1) {
    cv::fillPoly(canvas, outline, scalar(paint.colour), cv::LINE_8, kShift);
    return;
  }
  cv::Mat covered = canvas.clone();
  cv::fillPoly(covered, outline, scalar(paint.colour), cv::LINE_8, kShift);
  cv::addWeighted(covered, paint.opacity, canvas, 1 - paint.opacity, 0, canvas);
}

// The dashes of a line, from its beginning on.
std::vector<Points> dashes_of(const Points& points, double dash_px) {
  std::vector<Points> dashes{{points.front()}};
  double left_px = dash_px;
  bool drawn = true;
  for (std::size_t i = 1; i < points.size(); ++i) {
    Eigen::Vector2d at = points[i - 1];
    while ((points[i] - at).norm() > left_px) {
      at += left_px * (points[i] - at).normalized();
      if (drawn) {
        dashes.back().push_back(at);
      } else {
        dashes.push_back({at});
      }
      drawn = !drawn;
      left_px = dash_px;
    }
    left_px -= (points[i] - at).norm();
    if (drawn) dashes.back().push_back(points[i]);
  }
  return dashes;
}

void paint_line(cv::Mat& canvas, const Points& points, const Pen& pen) {
  if (points.size() < 2) return;
  const int thickness = std::max(1, cvRound(pen.width_px * kOversampling));
  const std::vector<Points> strokes = pen.dash_px > 0 ? dashes_of(points, pen.dash_px) : std::vector<Points>{points};
  for (const Points& stroke : strokes) {
    cv::polylines(canvas, std::vector<std::vector<cv::Point>>{fixed_point(stroke)}, false, scalar(pen.colour),
                  thickness, cv::LINE_8, kShift);
  }
}

// Writes with the stroke font, which has no sign for degrees: that is a ring. Gives the width; paints where `canvas`
// is.
double stroke_text(cv::Mat* canvas, const Eigen::Vector2d& foot, const std::string& text, double scale, int thickness,
                   const cv::Scalar& colour) {
  double x = foot.x();
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t sign = std::min(text.find(kDegreeSign, from), text.size());
    const std::string piece = text.substr(from, sign - from);
    int baseline = 0;
    if (canvas && !piece.empty()) {
      cv::putText(*canvas, piece, {cvRound(x), cvRound(foot.y())}, kFont, scale, colour, thickness, cv::LINE_AA);
    }
    if (!piece.empty()) x += cv::getTextSize(piece, kFont, scale, 1, &baseline).width;  // a halo's pen moves nothing
    if (sign < text.size()) {
      const double radius = 3.2 * scale;
      if (canvas) {
        cv::circle(*canvas, {cvRound(x + radius), cvRound(foot.y() - kCapitals_px * scale + radius)}, cvRound(radius),
                   colour, thickness, cv::LINE_AA);
      }
      x += 3 * radius;
    }
    from = sign + std::string(kDegreeSign).size();
  }
  return x - foot.x();
}

void paint_text(cv::Mat& canvas, const Eigen::Vector2d& foot, const std::string& text, const Lettering& lettering) {
  const double scale = kOversampling * lettering.size_px * kCapitalsOfSize / kCapitals_px;
  const int thickness = std::max(1, cvRound(kOversampling * lettering.size_px / 13));
  const double width = stroke_text(nullptr, {0, 0}, text, scale, thickness, {});
  const double part = lettering.anchor == Anchor::start ? 0 : lettering.anchor == Anchor::middle ? 0.5 : 1;
  const Eigen::Vector2d start = kOversampling * foot - Eigen::Vector2d(part * width, 0);
  if (lettering.halo) stroke_text(&canvas, start, text, scale, thickness + 4 * kOversampling, cv::Scalar::all(255));
  stroke_text(&canvas, start, text, scale, thickness, scalar(lettering.colour));
}

void paint_image(cv::Mat& canvas, const Eigen::Vector2d& top_left, const Eigen::Vector2d& bottom_right,
                 const Image<Rgb8>& pixels) {
  const cv::Point from(cvRound(kOversampling * top_left.x()), cvRound(kOversampling * top_left.y())),
      to(cvRound(kOversampling * bottom_right.x()), cvRound(kOversampling * bottom_right.y()));
  const cv::Rect place = cv::Rect(from, to) & cv::Rect(0, 0, canvas.cols, canvas.rows);
  if (place != cv::Rect(from, to) || place.empty() || pixels.empty()) return;
  // Larger: pixels stay sharp. Smaller: each pixel is the mean of what it covers.
  const bool larger = place.width >= pixels.width();
  cv::resize(as_mat(pixels.view()), canvas(place), place.size(), 0, 0, larger ? cv::INTER_NEAREST : cv::INTER_AREA);
}

}  // namespace

std::string Drawing::to_svg() const {
  struct Write {
    std::string operator()(const Area& a) const {
      return fmt::format("<polygon points=\"{}\" fill=\"{}\" fill-opacity=\"{}\"/>\n", svg_points(a.corners),
                         hex(a.paint.colour), a.paint.opacity);
    }
    std::string operator()(const Line& l) const {
      const std::string dash = l.pen.dash_px > 0 ? fmt::format(" stroke-dasharray=\"{}\"", l.pen.dash_px) : "";
      return fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\"{}/>\n",
                         svg_points(l.points), hex(l.pen.colour), l.pen.width_px, dash);
    }
    std::string operator()(const Text& w) const {
      const char* const anchors[] = {"start", "middle", "end"};
      const char* halo = w.lettering.halo
                             ? " stroke=\"#ffffff\" stroke-width=\"4\" stroke-linejoin=\"round\" paint-order=\"stroke\""
                             : "";
      return fmt::format(
          "<text x=\"{:.2f}\" y=\"{:.2f}\" font-size=\"{}\" text-anchor=\"{}\" fill=\"{}\"{}>{}</text>\n", w.foot.x(),
          w.foot.y(), w.lettering.size_px, anchors[static_cast<int>(w.lettering.anchor)], hex(w.lettering.colour), halo,
          html_text(w.text));
    }
    std::string operator()(const PlacedImage& p) const {
      const Eigen::Vector2d size = p.bottom_right - p.top_left;
      return fmt::format(
          "<image x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" preserveAspectRatio=\"none\" "
          "style=\"image-rendering:pixelated\" href=\"{}\"/>\n",
          p.top_left.x(), p.top_left.y(), size.x(), size.y(), data_url(p.pixels.view()));
    }
  };
  std::string text = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" "
      "font-family=\"Helvetica, Arial, sans-serif\">\n<rect width=\"{0}\" height=\"{1}\" fill=\"#ffffff\"/>\n",
      width_px_, height_px_);
  for (const Part& part : parts_) text += std::visit(Write{}, part);
  return text + "</svg>\n";
}

Image<Rgb8> Drawing::to_image() const {
  cv::Mat canvas(height_px_ * kOversampling, width_px_ * kOversampling, CV_8UC3, cv::Scalar::all(255));
  struct PaintPart {
    cv::Mat& canvas;
    void operator()(const Area& a) const { paint_area(canvas, a.corners, a.paint); }
    void operator()(const Line& l) const { paint_line(canvas, l.points, l.pen); }
    void operator()(const Text& w) const { paint_text(canvas, w.foot, w.text, w.lettering); }
    void operator()(const PlacedImage& p) const { paint_image(canvas, p.top_left, p.bottom_right, p.pixels); }
  };
  for (const Part& part : parts_) std::visit(PaintPart{canvas}, part);
  Image<Rgb8> image(width_px_, height_px_);
  cv::Mat finished = as_mat(image);
  cv::resize(canvas, finished, finished.size(), 0, 0, cv::INTER_AREA);
  return image;
}

}  // namespace spartan
