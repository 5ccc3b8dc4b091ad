#include "spartan/report/internal/sensor_section.h"

#include <fmt/format.h>

#include <algorithm>

#include "spartan/figures/html.h"
#include "spartan/system/run_store.h"

namespace spartan::internal {
namespace {

constexpr std::size_t kMostOutages = 20;  // listed per sensor

std::string outage_table(const std::string& sensor, const std::vector<SensorOutage>& outages, Stamp begin) {
  std::vector<std::vector<std::string>> rows{{sensor, "from, s", "to, s", "frame id", "frames"}};
  const std::size_t shown = std::min(kMostOutages, outages.size());
  rows.reserve(shown + 2);
  for (std::size_t i = 0; i < shown; ++i) {
    const SensorOutage& s = outages[i];
    rows.push_back(
        {s.state + ": " + s.reason, fmt::format("{:.1f}", seconds_between(begin, s.from)),
         fmt::format("{:.1f}", seconds_between(begin, s.to)),
         s.frames == 1 ? std::to_string(s.first_frame_id) : fmt::format("{} – {}", s.first_frame_id, s.last_frame_id),
         std::to_string(s.frames)});
  }
  if (outages.size() > shown) rows.push_back({fmt::format("and {} more", outages.size() - shown), "", "", "", ""});
  return html_table("Outages of " + sensor, rows);
}

// States in which a sensor has measured.
bool has_measured(const Json& states) {
  return states["ok"].get<int>() + states["suspect"].get<int>() + states["excluded"].get<int>() > 0;
}

}  // namespace

std::string sensor_tables(const Json& summary, const std::vector<FrameRecord>& frames) {
  std::vector<std::vector<std::string>> counts{{"sensor", "ok", "suspect", "excluded", "missing"}};
  std::string outages_html, absent;
  for (const auto& [sensor, states] : summary["health"]["localization"].items()) {
    if (!has_measured(states)) {
      absent += (absent.empty() ? "" : ", ") + sensor;
      continue;
    }
    std::vector<std::string> row{sensor};
    for (std::size_t i = 1; i < counts.front().size(); ++i)
      row.push_back(std::to_string(states[counts.front()[i]].get<int>()));
    counts.push_back(std::move(row));
    const std::vector<SensorOutage> outages = sensor_outages(frames, sensor);
    if (!outages.empty()) outages_html += outage_table(sensor, outages, frames.front().stamp);
  }
  std::string html;
  if (counts.size() > 1) html += html_table("Frames by the state of each sensor of the localization", counts);
  if (!absent.empty()) html += "<p>Without a measurement in this run: " + html_text(absent) + ".</p>\n";
  if (!outages_html.empty()) {
    html +=
        "<p>Outages, in seconds after the first frame. Figures in a reason are those of its first frame. NIS: "
        "normalized innovation squared, χ² distributed where the covariances are right.</p>\n" +
        outages_html;
  }
  return html;
}

}  // namespace spartan::internal
