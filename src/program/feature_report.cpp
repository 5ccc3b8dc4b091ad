#include "program/feature_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "spartan/image_io/opencv_bridge.h"

namespace spartan::program {
namespace {

constexpr const char* kNoRepeatability =
    "the geometry of the images tells only the line on which a point lies, not its place";

std::string percent(const std::optional<double>& fraction) {
  return fraction ? fmt::format("{:.1f} %", 100 * *fraction) : "-";
}

Json to_json(const ComparedDetector& detector) {
  const FeatureComparison& c = detector.result;
  return {{"name", detector.name},
          {"features", {{"first", c.first.size()}, {"second", c.second.size()}}},
          {"repeatability", number(c.repeatability)},
          {"matches", c.matches.size()},
          {"correct", c.correct},
          {"precision", number(c.precision)},
          {"matching_score", number(c.matching_score)},
          {"time_ms", number(c.time_ms)}};
}

// Pixels of a drawing; sub-pixel bits of cv::line and cv::circle.
constexpr int kShift = 4;

cv::Point drawn(const Eigen::Vector2f& p, const cv::Point& corner) {
  return {static_cast<int>(std::lround((p.x() + static_cast<float>(corner.x)) * (1 << kShift))),
          static_cast<int>(std::lround((p.y() + static_cast<float>(corner.y)) * (1 << kShift)))};
}

// Images that are wider than this times their height are drawn one below the other.
constexpr double kWide = 1.8;

}  // namespace

Json comparison_to_json(const ComparisonSettings& settings, const std::vector<ComparedView>& views) {
  Json all = Json::array();
  bool only_lines = false;
  for (const ComparedView& view : views) {
    Json detectors = Json::array();
    for (const ComparedDetector& detector : view.detectors) detectors.push_back(to_json(detector));
    only_lines = only_lines || view.geometry != "homography";
    all.push_back({{"name", view.name},
                   {"geometry", view.geometry},
                   {"rotation_deg", view.made ? number(view.rotation_deg) : Json(nullptr)},
                   {"scale", view.made ? number(view.scale) : Json(nullptr)},
                   {"width", view.image.width()},
                   {"height", view.image.height()},
                   {"detectors", std::move(detectors)}});
  }
  Json json{{"schema", 1},
            {"features", settings.features},
            {"tolerance_px", number(settings.tolerance_px)},
            {"views", std::move(all)}};
  if (only_lines) json["reasons"] = {{"repeatability", kNoRepeatability}};
  return json;
}

std::string comparison_to_text(const ComparisonSettings& settings, const std::vector<ComparedView>& views) {
  std::string text =
      fmt::format("at most {} features of an image, tolerance {:g} px\n", settings.features, settings.tolerance_px);
  for (const ComparedView& view : views) {
    text += fmt::format("\n{} ({} x {} px, geometry: {})\n", view.name, view.image.width(), view.image.height(),
                        view.geometry);
    text += fmt::format("{:<14} {:>13} {:>14} {:>8} {:>10} {:>15} {:>9}\n", "detector", "features", "repeatability",
                        "matches", "precision", "matching score", "time");
    for (const auto& [name, c] : view.detectors) {
      text += fmt::format("{:<14} {:>6} {:>6} {:>14} {:>8} {:>10} {:>15} {:>6.2f} ms\n", name, c.first.size(),
                          c.second.size(), percent(c.repeatability), c.matches.size(), percent(c.precision),
                          percent(c.matching_score), c.time_ms);
    }
    if (view.geometry != "homography") text += fmt::format("no repeatability: {}\n", kNoRepeatability);
  }
  return text;
}

Image<Rgb8> draw_comparison(ImageView<const std::uint8_t> first, ImageView<const std::uint8_t> second,
                            const FeatureComparison& comparison) {
  const bool below = first.width() > kWide * first.height();
  const cv::Point corner(below ? 0 : first.width(), below ? first.height() : 0);  // of the second image
  Image<Rgb8> canvas(std::max(first.width(), corner.x + second.width()),
                     std::max(first.height(), corner.y + second.height()));
  const auto paste = [&](ImageView<const std::uint8_t> image, const cv::Point& at) {
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) {
        // Darker, so that the colours stand out.
        const auto gray = static_cast<std::uint8_t>(image(x, y) * 3 / 4);
        canvas(at.x + x, at.y + y) = {gray, gray, gray};
      }
    }
  };
  paste(first, {});
  paste(second, corner);
  cv::Mat mat = as_mat(canvas);
  const cv::Scalar green(60, 220, 80), red(255, 60, 50), yellow(250, 220, 70);
  const auto circles = [&](const std::vector<Eigen::Vector2f>& features, const cv::Point& at) {
    for (const Eigen::Vector2f& p : features)
      cv::circle(mat, drawn(p, at), 2 << kShift, yellow, 1, cv::LINE_AA, kShift);
  };
  circles(comparison.first, {});
  circles(comparison.second, corner);
  for (const bool correct : {true, false}) {  // the wrong ones on top
    for (const FeatureComparison::Match& match : comparison.matches) {
      if (match.correct != correct) continue;
      const cv::Scalar& colour = correct ? green : red;
      const cv::Point from = drawn(comparison.first[static_cast<std::size_t>(match.first)], {}),
                      to = drawn(comparison.second[static_cast<std::size_t>(match.second)], corner);
      cv::line(mat, from, to, colour, 1, cv::LINE_AA, kShift);
      for (const cv::Point& end : {from, to})
        cv::circle(mat, end, 2 << kShift, colour, cv::FILLED, cv::LINE_AA, kShift);
    }
  }
  return canvas;
}

}  // namespace spartan::program
