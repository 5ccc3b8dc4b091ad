#include "spartan/report/internal/truth_section.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "spartan/core/trajectory.h"
#include "spartan/eval/disparity_metrics.h"
#include "spartan/figures/colours.h"
#include "spartan/figures/html.h"
#include "spartan/figures/map_plot.h"
#include "spartan/reconstruction/disparity_computer.h"
#include "spartan/reconstruction/rendering.h"
#include "spartan/report/internal/page_parts.h"
#include "spartan/storage/geotiff.h"

namespace spartan::internal {
namespace {

constexpr double kErrorScale_px = 2;

std::string percent(std::optional<double> value) {
  return value ? fmt::format("{:.1f} %", *value) : "–";
}

Image<Rgb8> error_image(ImageView<const float> estimate, ImageView<const float> truth) {
  Image<Rgb8> image(estimate.width(), estimate.height());
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const double error = estimate(x, y) - truth(x, y);
      image(x, y) = std::isfinite(error) ? cold_to_hot(0.5 + 0.5 * error / kErrorScale_px) : Rgb8{40, 40, 40};
    }
  }
  return image;
}

// One frame of a pair with true disparities: disparity, error, scores.
Result<std::string> stereo_of(Recording& source, Imager& imager, const StereoPair& pair, const ReportRequest& request) {
  const std::vector<Stamp> stamps = source.listed_stamps(pair.name);
  if (stamps.empty()) return std::string();
  const Stamp stamp = stamps[stamps.size() / 2];
  const auto frame = source.frame_at(pair.name, stamp);
  if (!frame) return failure(frame);
  const std::string name = fmt::format("/{}/{}.png", pair.name, stamp.ns);
  const auto truth = read_disparity(request.recording + "/truth/disparity" + name);
  const auto mask = read_truth_mask(request.recording + "/truth/mask" + name);
  if (!truth || !mask) return std::string();
  const auto view = imager.process(*frame);
  if (!view) return failure(view);
  const Image<std::uint8_t> left = Image<std::uint8_t>::copy_of(view->left);
  auto computer = DisparityComputer::create(request.options.reconstruction, ThreadPool(request.threads));
  if (!computer) return failure(computer);
  const auto image = computer->compute(view->left, view->right, disparity_range(view->geometry, pair.nearest_m),
                                       view->left_mask, view->right_mask);
  if (!image) return failure(image);
  const auto scores = compare_disparities(image->disparity, *truth, *mask);
  if (!scores) return failure(scores);
  std::string html =
      html_image(shrunk(left.view(), kPageImage_px), fmt::format("{} pair, left camera, rectified", pair.name));
  html += html_image(shrunk(colour_disparity(image->disparity).view(), kPageImage_px),
                     "Disparity: near is red, far is blue, unknown is black",
                     to_html(ColourBar{"disparity, px", disparity_colour_range(image->disparity), disparity_colour}));
  html += html_image(shrunk(error_image(image->disparity, *truth).view(), kPageImage_px),
                     "Disparity error; unknown is gray",
                     to_html(ColourBar{"error, px", {-kErrorScale_px, kErrorScale_px}, cold_to_hot}));
  std::vector<std::vector<std::string>> rows{
      {"pixels", "density", "bad-1", "bad-1 of matched", "RMS of errors below 1 px"}};
  const auto add = [&](const std::string& what, const DisparityScores& s) {
    rows.push_back({what, percent(s.density_percent), percent(s.bad_1), percent(s.matched_bad_1),
                    s.rms_in_1px ? fmt::format("{:.3f} px", *s.rms_in_1px) : "–"});
  };
  add("all with ground truth", scores->all);
  if (scores->nonocc) add("non-occluded", *scores->nonocc);
  return "<div class=\"images\">" + html + "</div>" + html_table("Disparity errors, " + pair.name + " pair", rows);
}

// The true elevation with the true positions of the rover.
std::string elevation_of(const std::string& recording, const Trajectory& truth) {
  const auto map = read_geotiff(recording + "/truth/elevation.tif");
  if (!map || map->bands.empty()) return "";
  const Image<float>& z = map->bands[0];
  Plot plot = map_plot(z, Image<GroundClass>(z.width(), z.height(), GroundClass::ground), map->place, "True elevation");
  plot.keys.clear();
  plot.width_px = plot.height_px = 760;
  PlotLine way{"true positions of the rover", {20, 20, 20}, {}, {}};
  for (const StampedPose& p : truth) {
    way.x.push_back(p.pose.translation().x());
    way.y.push_back(p.pose.translation().y());
  }
  plot.lines.push_back(std::move(way));
  return to_html(plot);
}

}  // namespace

Result<std::string> truth_section(Recording& source, Imager& imager, const ReportRequest& request) {
  std::string stereo;
  for (const StereoPair& pair : source.info().rig.pairs) {
    const auto html = stereo_of(source, imager, pair, request);
    if (!html) return failure(html);
    stereo += *html;
  }
  const auto truth = load_trajectory(source.info().truth_file);
  if (!truth) return failure(truth);
  return stereo + elevation_of(request.recording, truth->poses);
}

}  // namespace spartan::internal
