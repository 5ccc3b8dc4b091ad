#include "spartan/report/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <vector>

#include "spartan/camera/frame_source.h"
#include "spartan/core/files.h"
#include "spartan/core/trajectory.h"
#include "spartan/eval/disparity_metrics.h"
#include "spartan/eval/trajectory_metrics.h"
#include "spartan/imaging/imager.h"
#include "spartan/reconstruction/disparity_computer.h"
#include "spartan/reconstruction/rendering.h"
#include "spartan/report/internal/html_parts.h"
#include "spartan/report/internal/map_section.h"
#include "spartan/report/internal/sensor_section.h"
#include "spartan/report/internal/trajectory_section.h"
#include "spartan/storage/geotiff.h"
#include "spartan/system/run_folder.h"
#include "spartan/system/run_store.h"

namespace spartan {

using namespace internal;

namespace {

constexpr int kDriveImages = 6;
constexpr double kErrorScale_px = 2;

std::string section(const std::string& title, const std::string& body) {
  return "<h2>" + html_text(title) + "</h2>\n" + body;
}

std::string percent(std::optional<double> value) {
  return value ? fmt::format("{:.1f} %", *value) : "–";
}

// The left images along the drive.
Result<std::string> drive_images(FrameSource& source, Imager& imager) {
  std::string html;
  for (const StereoPair& pair : source.info().rig.pairs) {
    if (!pair.for_odometry) continue;
    const std::vector<Stamp> stamps = source.listed_stamps(pair.name);
    const int count = std::min<int>(kDriveImages, static_cast<int>(stamps.size()));
    for (int i = 0; i < count; ++i) {
      const Stamp stamp =
          stamps[count > 1 ? static_cast<std::size_t>(i) * (stamps.size() - 1) / static_cast<std::size_t>(count - 1)
                           : 0];
      const auto frame = source.frame_at(pair.name, stamp);
      if (!frame) continue;
      const auto view = imager.process(*frame);
      if (!view && view.error().code == ErrorCode::frame_rejected) continue;  // the run has skipped it as well
      if (!view) return failure(view);
      html += html_image(
          shrunk(view->left, 360),
          fmt::format("{} pair, left camera, after {:.0f} s", pair.name, seconds_between(stamps.front(), stamp)), 360);
    }
  }
  return html;
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
Result<std::string> stereo_of(FrameSource& source, Imager& imager, const StereoPair& pair,
                              const ReportRequest& request) {
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
      html_image(shrunk(left.view(), 360), fmt::format("{} pair, left camera, rectified", pair.name), 360);
  html += html_image(shrunk(colour_disparity(image->disparity).view(), 360),
                     "Disparity: near is red, far is violet, black is unknown", 360);
  html +=
      html_image(shrunk(error_image(image->disparity, *truth).view(), 360),
                 fmt::format("Disparity error: white 0, blue −{0} px, red +{0} px, gray unknown", kErrorScale_px), 360);
  std::vector<std::vector<std::string>> rows{
      {"pixels", "density", "bad-1", "bad-1 of matched", "RMS of errors below 1 px"}};
  const auto add = [&](const std::string& what, const DisparityScores& s) {
    rows.push_back({what, percent(s.density_percent), percent(s.bad_1), percent(s.matched_bad_1),
                    s.rms_in_1px ? fmt::format("{:.3f} px", *s.rms_in_1px) : "–"});
  };
  add("all with ground truth", scores->all);
  if (scores->nonocc) add("non-occluded", *scores->nonocc);
  return html + html_table(rows);
}

// Elevation in colour, shaded from the north-west.
std::string elevation_of(const std::string& recording, const Trajectory& truth) {
  const auto map = read_geotiff(recording + "/truth/elevation.tif");
  if (!map || map->bands.empty()) return "";
  const Image<float>& z = map->bands[0];
  std::vector<float> sorted;
  for (int y = 0; y < z.height(); ++y) sorted.insert(sorted.end(), z.row(y), z.row(y) + z.width());
  std::sort(sorted.begin(), sorted.end());
  const float low = sorted[sorted.size() / 100], high = sorted[sorted.size() - 1 - sorted.size() / 100];
  Image<Rgb8> image(z.width(), z.height());
  for (int y = 0; y < z.height(); ++y) {
    for (int x = 0; x < z.width(); ++x) {
      const float east = z(std::min(x + 1, z.width() - 1), y), south = z(x, std::min(y + 1, z.height() - 1));
      const double shade = std::clamp(1 + 0.5 * ((east - z(x, y)) + (south - z(x, y))) / map->place.cell_m, 0.35, 1.4);
      const Rgb8 c = cold_to_hot((z(x, y) - low) / std::max(high - low, 1e-6F));
      const auto lit = [&](std::uint8_t v) {
        return static_cast<std::uint8_t>(std::clamp(0.9 * shade * v, 0.0, 255.0));
      };
      image(x, y) = {lit(c.r), lit(c.g), lit(c.b)};
    }
  }
  for (const StampedPose& p : truth) {
    const int x = static_cast<int>((p.pose.translation().x() - map->place.west_m) / map->place.cell_m);
    const int y = static_cast<int>((map->place.north_m - p.pose.translation().y()) / map->place.cell_m);
    for (int dy = -2; dy <= 2; ++dy) {
      for (int dx = -2; dx <= 2; ++dx) {
        if (image.view().contains(x + dx, y + dy)) image(x + dx, y + dy) = {20, 20, 20};
      }
    }
  }
  return html_image(shrunk(image.view(), 720),
                    fmt::format("True elevation, {:.2f} m (blue) to {:.2f} m (red), {:.1f} m × {:.1f} m, north up; "
                                "black: true positions of the rover",
                                low, high, z.width() * map->place.cell_m, z.height() * map->place.cell_m),
                    720);
}

std::string stage_table(const Json& summary) {
  std::vector<std::vector<std::string>> rows{{"stage", "count", "median, ms", "95th percentile, ms", "CPU median, ms"}};
  for (const auto& [name, stage] : summary["stages"].items()) {
    rows.push_back({name, std::to_string(stage["count"].get<int>()),
                    fmt::format("{:.1f}", stage["wall_ms"]["median"].get<double>()),
                    fmt::format("{:.1f}", stage["wall_ms"]["p95"].get<double>()),
                    fmt::format("{:.1f}", stage["cpu_ms"]["median"].get<double>())});
  }
  return html_table(rows);
}

std::string figure(const std::string& value, const std::string& what) {
  return "<div><b>" + html_text(value) + "</b>" + html_text(what) + "</div>";
}

Result<std::string> figures_of(const Json& summary, const ReportRequest& request) {
  std::string html = "<div class=\"figures\">";
  html += figure(fmt::format("{:.2f} m", summary["distance_m"].get<double>()), "distance driven");
  if (!request.truth.empty()) {
    const auto compared = find_trajectories(request.run, request.truth, "");
    if (!compared) return failure(compared);
    const auto metrics = errors_of(*compared);
    if (!metrics) return failure(metrics);
    html += figure(fmt::format("{:.1f} mm", 1000 * metrics->ate_m.rmse),
                   "position error, RMS, " + alignment_text(metrics->alignment));
    if (metrics->drift_percent)
      html += figure(fmt::format("{:.2f} %", *metrics->drift_percent), "drift, of the distance");
  }
  html += figure(
      fmt::format("{} of {}", summary["health"]["odometry"]["tracking"].get<int>(), summary["frames"].get<int>()),
      "frames tracked");
  html += figure(fmt::format("{:.1f} s", summary["wall_seconds"].get<double>()), "wall time");
  return html + "</div>\n";
}

Result<std::string> whole_truth(FrameSource& source, Imager& imager, const ReportRequest& request) {
  std::string stereo;
  for (const StereoPair& pair : source.info().rig.pairs) {
    const auto html = stereo_of(source, imager, pair, request);
    if (!html) return failure(html);
    stereo += *html;
  }
  const auto truth = load_trajectory(source.info().truth_file);
  if (!truth) return failure(truth);
  return section("Stereo matching", stereo) + section("True elevation", elevation_of(request.recording, truth->poses));
}

}  // namespace

Result<std::string> make_report(ReportRequest request) {
  const RunFolder folder{request.run};
  const auto summary_text = read_file(folder.summary());
  if (!summary_text) return failure(summary_text);
  const Json summary = Json::parse(*summary_text);
  auto store = RunStore::open_read_only(folder.store());
  if (!store) return failure(store);
  const auto frames = store->frames();
  if (!frames) return failure(frames);
  const auto source = open_recording(request.recording, request.open);
  if (!source) return failure(source);
  const RecordingInfo& info = (*source)->info();
  if (request.truth.empty()) request.truth = info.truth_file;
  const std::string masks = std::filesystem::path(info.rig_source).parent_path().string();
  auto imager = Imager::create(info.rig, request.options.imaging, ThreadPool(request.threads), masks);
  if (!imager) return failure(imager);

  std::string body =
      "<h1>" + html_text("Spartan: " + info.name) + "</h1>\n<p>" + html_text(info.description) + "</p>\n";
  const auto figures = figures_of(summary, request);
  if (!figures) return failure(figures);
  body += *figures;
  const auto images = drive_images(**source, *imager);
  if (!images) return failure(images);
  body += section("Images", *images);
  const auto plots = trajectory_plots(request.run, *frames, request.truth);
  if (!plots) return failure(plots);
  body += section("Trajectories", *plots);
  if (!summary["health"]["localization"].empty()) body += section("Sensors", sensor_tables(summary, *frames));
  const auto maps = map_images(request.run);
  if (!maps) return failure(maps);
  if (!maps->empty()) body += section("Maps", *maps);
  if (request.whole_truth) {
    const auto truth = whole_truth(**source, *imager, request);
    if (!truth) return failure(truth);
    body += *truth;
  }
  body +=
      section("Time and memory", stage_table(summary) + fmt::format("<p>Peak memory {:.0f} MB, {} threads.</p>\n",
                                                                    summary["peak_memory_bytes"].get<double>() / 1e6,
                                                                    summary["threads"].get<int>()));
  return html_page("Spartan: " + info.name, body);
}

}  // namespace spartan
