#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "spartan/image_io/opencv_bridge.h"
#include "spartan/imaging/imager.h"
#include "spartan/report/report.h"

namespace spartan {
namespace {

constexpr int kWidest_px = 640, kLines = 12, kHeading_px = 22;
constexpr int kArrowScale = 10;

// One strip of the figure: two images with their matches; without images, only the heading.
struct Strip {
  std::string heading;
  Image<std::uint8_t> left, right;
  std::vector<PixelMatch> matches;
};

std::string to_text(const RowErrors& rows) {
  if (!std::isfinite(rows.mean_px)) return "too few matches";
  return fmt::format("mean row error {:.2f} px, 95th percentile {:.2f} px", rows.mean_px, rows.p95_px);
}

// Green up to half a pixel, then yellow, red from 3 px on.
cv::Scalar colour_of(double error_px) {
  const double t = std::clamp((std::abs(error_px) - 0.5) / 2.5, 0.0, 1.0);
  return {255 * std::min(1.0, 2 * t), 255 * std::min(1.0, 2 - 2 * t), 40};
}

std::optional<Strip> rectified(const Rig& rig, const StereoPair& pair, const Strip& taken, const ThreadPool& workers) {
  const Camera *left = rig.find_camera(pair.left), *right = rig.find_camera(pair.right);
  const auto plan = plan_rectification(*left, *right, rig.right_from_left(pair), pair.name);
  auto imager = Imager::create(rig, {}, workers);
  if (!plan || !imager) return std::nullopt;
  StereoFrame frame;
  frame.pair = pair.name;
  frame.left = FrameImage::borrow(std::as_const(taken.left).view(), {});
  frame.right = FrameImage::borrow(std::as_const(taken.right).view(), {});
  const auto views = imager->process(frame);
  if (!views) return std::nullopt;
  Strip strip{{}, Image<std::uint8_t>::copy_of(views->left), Image<std::uint8_t>::copy_of(views->right), {}};
  const auto place = [&](const Camera& camera, const Eigen::Matrix3d& from_rectified, const Eigen::Vector2d& pixel) {
    const auto ray = unproject(camera.model, pixel);
    if (!ray) return Eigen::Vector2d(NAN, NAN);
    const Eigen::Vector3d seen = from_rectified.transpose() * ray->direction;
    return Eigen::Vector2d(plan->geometry.focal_px * seen.head<2>() / seen.z() + plan->geometry.centre_px);
  };
  strip.matches.reserve(taken.matches.size());
  for (const PixelMatch& match : taken.matches) {
    strip.matches.push_back(
        {place(*left, plan->left_from_rectified, match.left), place(*right, plan->right_from_rectified, match.right)});
  }
  return strip;
}

// The rig with the pixel format of the strips: 8-bit gray, without masks.
Rig plain(Rig rig) {
  for (Camera& camera : rig.cameras) {
    camera.pixel_format = {};
    camera.self_mask.clear();
  }
  return rig;
}

constexpr std::uint8_t kGround = 24;
const cv::Scalar kOutlierGray{110, 110, 110};

// `outlier`: matches that do not fit the corrected pair.
void draw_matches(const Strip& strip, const std::vector<bool>& outlier, cv::Mat views, double scale) {
  const int width = views.cols / 2;
  const auto at = [&](const Eigen::Vector2d& p, int shift) {
    return cv::Point(static_cast<int>(std::lround((p.x() + 0.5) * scale)) + shift,
                     static_cast<int>(std::lround((p.y() + 0.5) * scale)));
  };
  for (std::size_t i = 0; i < strip.matches.size(); ++i) {
    const PixelMatch& match = strip.matches[i];
    if (!match.left.allFinite() || !match.right.allFinite()) continue;
    const double error_px = match.right.y() - match.left.y();
    const cv::Point from = at(match.left, 0), other = at(match.right, width);
    if (from.x < 0 || from.x >= width || other.x < width || other.x >= 2 * width) continue;
    const cv::Scalar colour = outlier[i] ? kOutlierGray : colour_of(error_px);
    if (outlier[i]) {
      cv::circle(views, from, 2, colour, 1, cv::LINE_AA);
    } else {
      const cv::Point to = from + cv::Point(0, static_cast<int>(std::lround(kArrowScale * error_px * scale)));
      cv::arrowedLine(views, from, to, colour, 1, cv::LINE_AA, 0, 0.25);
    }
    cv::circle(views, other, 2, colour, outlier[i] ? 1 : cv::FILLED, cv::LINE_AA);
  }
}

void draw(const Strip& strip, const std::vector<bool>& outlier, cv::Mat canvas, double scale) {
  const int width = canvas.cols / 2, height = canvas.rows - kHeading_px;
  canvas.setTo(cv::Scalar::all(kGround));
  cv::putText(canvas, strip.heading, {6, 15}, cv::FONT_HERSHEY_SIMPLEX, 0.45, {235, 235, 235}, 1, cv::LINE_AA);
  if (strip.left.empty()) return;
  const cv::Mat views = canvas(cv::Rect(0, kHeading_px, canvas.cols, height));
  for (const bool second : {false, true}) {
    cv::Mat small, colour;
    const cv::Rect place(second ? width : 0, 0, width, height);
    cv::resize(as_mat(second ? strip.right : strip.left), small, place.size(), 0, 0, cv::INTER_AREA);
    cv::cvtColor(small, colour, cv::COLOR_GRAY2RGB);
    colour.copyTo(views(place));
  }
  for (int line = 1; line < kLines; ++line) {
    const int y = line * height / kLines;
    cv::line(views, {0, y}, {views.cols - 1, y}, {70, 130, 220}, 1);
  }
  draw_matches(strip, outlier, views, scale);
}

std::vector<bool> find_outliers(const Strip& corrected, double limit_px) {
  std::vector<bool> outlier;
  outlier.reserve(corrected.matches.size());
  for (const PixelMatch& match : corrected.matches)
    outlier.push_back(!(std::abs(match.left.y() - match.right.y()) <= limit_px));
  return outlier;
}

// The strip of the given calibration.
Strip nominal_rows(const Rig& rig, const StereoPair& pair, const PairCheck& check, const Strip& taken,
                   const ThreadPool& workers) {
  auto given = check.has_gross_error ? std::nullopt : rectified(plain(rig), pair, taken, workers);
  if (!given) return {"the given calibration cannot be rectified: cameras, sides or sizes are wrong", {}, {}, {}};
  given->heading = "rectified with the given calibration: " + to_text(check.nominal_rows);
  return std::move(*given);
}

}  // namespace

Result<Image<Rgb8>> draw_pair_check(const Rig& rig, const StereoPair& pair, const PairCheck& check,
                                    ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right,
                                    const std::vector<PixelMatch>& matches, const ThreadPool& workers) {
  const auto copy = [](ImageView<const std::uint8_t> view) { return Image<std::uint8_t>::copy_of(view); };
  std::vector<Strip> strips;
  strips.push_back({"unrectified: " + to_text(check.unrectified_rows), copy(left), copy(right), matches});
  strips.push_back(nominal_rows(rig, pair, check, strips.front(), workers));
  std::vector<bool> outlier(matches.size(), false);
  if (check.corrected) {
    const bool exchanged = check.images_swapped;
    Strip taken{{}, copy(exchanged ? right : left), copy(exchanged ? left : right), matches};
    for (PixelMatch& match : taken.matches) {
      if (exchanged) std::swap(match.left, match.right);
    }
    if (auto corrected = rectified(plain(*check.corrected), *check.corrected->find_pair(pair.name), taken, workers)) {
      corrected->heading =
          fmt::format("corrected: {} (arrows enlarged {} times)", to_text(check.corrected_rows), kArrowScale);
      if (check.inlier_limit_px > 0) outlier = find_outliers(*corrected, check.inlier_limit_px);
      strips.push_back(std::move(*corrected));
    }
  }
  const double scale = std::min(1.0, static_cast<double>(kWidest_px) / left.width());
  const int width = static_cast<int>(left.width() * scale), height = static_cast<int>(left.height() * scale);
  const auto height_of = [&](const Strip& strip) { return kHeading_px + (strip.left.empty() ? 0 : height); };
  int whole = 0;
  for (const Strip& strip : strips) whole += height_of(strip);
  Image<Rgb8> figure(2 * width, whole);
  cv::Mat canvas = as_mat(figure);
  int top = 0;
  for (const Strip& strip : strips) {
    draw(strip, outlier, canvas(cv::Rect(0, top, 2 * width, height_of(strip))), scale);
    top += height_of(strip);
  }
  return figure;
}

}  // namespace spartan
