#include "program/report_sensors.h"

#include <fmt/format.h>

#include <algorithm>

#include "program/html_parts.h"
#include "spartan/system/sensor_spells.h"

namespace spartan::program {
namespace {

constexpr std::size_t kMostSpells = 20;  // of a sensor

std::string spell_table(const std::string& sensor, const std::vector<SensorSpell>& spells, Stamp begin) {
  std::vector<std::vector<std::string>> rows{{sensor, "from, s", "to, s", "frame id", "frames"}};
  const std::size_t shown = std::min(kMostSpells, spells.size());
  rows.reserve(shown + 2);
  for (std::size_t i = 0; i < shown; ++i) {
    const SensorSpell& s = spells[i];
    rows.push_back(
        {s.state + ": " + s.reason, fmt::format("{:.1f}", seconds_between(begin, s.from)),
         fmt::format("{:.1f}", seconds_between(begin, s.to)),
         s.frames == 1 ? std::to_string(s.first_frame_id) : fmt::format("{} – {}", s.first_frame_id, s.last_frame_id),
         std::to_string(s.frames)});
  }
  if (spells.size() > shown) rows.push_back({fmt::format("and {} more", spells.size() - shown), "", "", "", ""});
  return html_table(rows);
}

}  // namespace

std::string sensor_tables(const Json& summary, const std::vector<FrameRecord>& frames) {
  std::vector<std::vector<std::string>> counts{{"sensor", "ok", "suspect", "excluded", "missing"}};
  std::string spells_html;
  for (const auto& [sensor, states] : summary["health"]["localization"].items()) {
    std::vector<std::string> row{sensor};
    for (std::size_t i = 1; i < counts.front().size(); ++i)
      row.push_back(std::to_string(states[counts.front()[i]].get<int>()));
    counts.push_back(std::move(row));
    const std::vector<SensorSpell> spells = sensor_spells(frames, sensor);
    if (!spells.empty()) spells_html += spell_table(sensor, spells, frames.front().stamp);
  }
  std::string html = "<p>Frames by what each sensor of the localization was worth.</p>\n" + html_table(counts);
  if (!spells_html.empty()) {
    html +=
        "<p>When a sensor was not ok, in seconds after the first frame; the figures of a reason are those of its first "
        "frame.</p>\n" +
        spells_html;
  }
  return html;
}

}  // namespace spartan::program
