#include "spartan/report/internal/sensor_section.h"

#include <fmt/format.h>

#include <algorithm>

#include "spartan/report/internal/html_parts.h"
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
  return html_table(rows);
}

}  // namespace

std::string sensor_tables(const Json& summary, const std::vector<FrameRecord>& frames) {
  std::vector<std::vector<std::string>> counts{{"sensor", "ok", "suspect", "excluded", "missing"}};
  std::string outages_html;
  for (const auto& [sensor, states] : summary["health"]["localization"].items()) {
    std::vector<std::string> row{sensor};
    for (std::size_t i = 1; i < counts.front().size(); ++i)
      row.push_back(std::to_string(states[counts.front()[i]].get<int>()));
    counts.push_back(std::move(row));
    const std::vector<SensorOutage> outages = sensor_outages(frames, sensor);
    if (!outages.empty()) outages_html += outage_table(sensor, outages, frames.front().stamp);
  }
  std::string html = "<p>Number of frames by state of each sensor of the localization.</p>\n" + html_table(counts);
  if (!outages_html.empty()) {
    html += "<p>Outages, in seconds after the first frame. Figures in a reason are those of its first frame.</p>\n" +
            outages_html;
  }
  return html;
}

}  // namespace spartan::internal
