#include "spartan/report/report.h"

#include <fmt/format.h>

#include <utility>
#include <vector>

#include "spartan/camera/recording.h"
#include "spartan/core/files.h"
#include "spartan/eval/trajectory_metrics.h"
#include "spartan/figures/html.h"
#include "spartan/imaging/imager.h"
#include "spartan/report/internal/image_section.h"
#include "spartan/report/internal/map_section.h"
#include "spartan/report/internal/page.h"
#include "spartan/report/internal/run_section.h"
#include "spartan/report/internal/scene_section.h"
#include "spartan/report/internal/sensor_section.h"
#include "spartan/report/internal/trajectory_section.h"
#include "spartan/report/internal/truth_section.h"
#include "spartan/system/run_folder.h"
#include "spartan/system/run_store.h"

namespace spartan {

using namespace internal;

namespace {

std::string number(const std::string& value, const std::string& what) {
  return "<li><b>" + html_text(value) + "</b>" + html_text(what) + "</li>\n";
}

std::string length_text(double m) {
  return m < 1 ? fmt::format("{:.1f} mm", 1000 * m) : fmt::format("{:.2f} m", m);
}

std::string tracked_frames(const Json& summary) {
  const Json& odometry = summary["health"]["odometry"];
  const int stationary = odometry["standing"].get<int>(), degraded = odometry["degraded"].get<int>();
  std::string what = "frames tracked";
  if (stationary > 0) what += fmt::format(", {} of them stationary", stationary);
  if (degraded > 0) what += fmt::format(", {} degraded", degraded);
  return number(
      fmt::format("{} of {}", odometry["tracking"].get<int>() + stationary + degraded, summary["frames"].get<int>()),
      what);
}

Result<std::string> key_numbers(const Json& summary, const ReportRequest& request) {
  std::string html = "<ul class=\"numbers\">";
  html += number(fmt::format("{:.2f} m", summary["distance_m"].get<double>()), "distance driven");
  if (!request.truth.empty()) {
    const auto compared = find_trajectories(request.run, request.truth, "");
    if (!compared) return failure(compared);
    const auto metrics = compare_trajectories(compared->estimate, compared->truth, {});
    if (!metrics) return failure(metrics);
    html += number(length_text(metrics->ate_m.rmse), "position error, RMS, SE3 alignment");
    if (metrics->ate_first_rmse_m)
      html += number(length_text(*metrics->ate_first_rmse_m), "position error, RMS, first poses aligned");
    if (metrics->drift_percent)
      html += number(fmt::format("{:.2f} %", *metrics->drift_percent), "drift, of the distance");
  }
  html += tracked_frames(summary);
  const double seconds = summary["wall_seconds"].get<double>();
  if (seconds > 0)
    html += number(fmt::format("{:.1f}", summary["frames"].get<double>() / seconds), "frames per second, all stages");
  return html + "</ul>\n";
}

// Spans without a pose by the odometry.
std::string lost_text(const Json& summary) {
  const Json& spans = summary["lost_spans"];
  if (spans.empty()) return "";
  std::string html = "<div class=\"warning\"><p>The rover was lost: the poses there are predictions.</p><ul>\n";
  for (const Json& span : spans) {
    const double seconds = 1e-9 * (span["to_ns"].get<double>() - span["from_ns"].get<double>());
    html += fmt::format("<li>for {:.1f} s from {} s on: {}</li>\n", seconds,
                        to_decimal_seconds(Stamp{span["from_ns"].get<std::int64_t>()}),
                        html_text(span["reason"].get<std::string>()));
  }
  return html + "</ul></div>\n";
}

struct Section {
  const char* title;
  Result<std::string> body;
};

}  // namespace

Result<std::string> make_report(ReportRequest request) {
  const RunFolder folder{request.run};
  const auto summary_text = read_file(folder.summary());
  if (!summary_text) return failure(summary_text);
  const Json summary = Json::parse(*summary_text);
  const bool heading_east = summary["world"]["heading"] == "east";
  auto store = RunStore::open_read_only(folder.store());
  if (!store) return failure(store);
  const auto frames = store->frames();
  if (!frames) return failure(frames);
  const auto source = open_recording(request.recording, request.open);
  if (!source) return failure(source);
  const RecordingInfo& info = (*source)->info();
  if (request.truth.empty()) request.truth = info.truth_file;
  auto imager = Imager::create(info.rig, request.options.imaging, ThreadPool(request.threads), info.mask_folder());
  if (!imager) return failure(imager);
  auto global_map = global_map_figures(request.run, *store, heading_east);
  if (!global_map) return failure(global_map);
  const auto local_maps = local_map_figures(request.run, *store, heading_east);
  if (!local_maps) return failure(local_maps);
  const auto numbers = key_numbers(summary, request);
  if (!numbers) return failure(numbers);

  std::string header = info.description.empty() ? "" : "<p>" + html_text(info.description) + "</p>\n";
  header += *numbers + lost_text(summary);
  const Section sections[] = {
      {"Images", image_section(**source, *imager)},
      {"Trajectories",
       trajectory_section({request.run, request.truth, *frames, std::move(global_map->map), heading_east})},
      {"Map in 3D", scene_section(request.run, *store, *frames)},
      {"Terrain", terrain_section(**source, *imager, request.run, *store)},
      {"Maps", global_map->coverage + *local_maps},
      {"Sensors", summary["health"]["localization"].empty() ? std::string() : sensor_tables(summary, *frames)},
      {"Truth", request.whole_truth ? truth_section(**source, *imager, request) : std::string()},
      {"Cameras", rig_section(info.rig)},
      {"Time and memory", time_section(summary)},
      {"Run", run_section(summary, request, info)},
  };
  std::vector<PageSection> parts;
  for (const Section& section : sections) {
    if (!section.body) return failure(section.body);
    parts.push_back({section.title, *section.body});
  }
  return html_page("Spartan: " + info.name, header, parts);
}

}  // namespace spartan
