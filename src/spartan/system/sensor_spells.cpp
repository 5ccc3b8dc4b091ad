#include "spartan/system/sensor_spells.h"

#include <algorithm>
#include <string_view>

namespace spartan {
namespace {

std::string_view kind_of(std::string_view reason) {
  return reason.substr(0, reason.find_first_of(":0123456789"));
}

bool goes_on(const SensorSpell& spell, const LocalizationRecord::Sensor& sensor) {
  return spell.state == sensor.state && kind_of(spell.reason) == kind_of(sensor.reason);
}

}  // namespace

std::vector<SensorSpell> sensor_spells(const std::vector<FrameRecord>& frames, const std::string& sensor) {
  std::vector<SensorSpell> spells;
  bool was_ok = true;
  for (const FrameRecord& frame : frames) {
    if (!frame.localization) continue;
    const auto& sensors = frame.localization->sensors;
    const auto found = std::find_if(sensors.begin(), sensors.end(), [&](const auto& s) { return s.name == sensor; });
    if (found == sensors.end()) continue;
    const bool is_ok = found->state == "ok";
    if (!is_ok) {
      if (was_ok || !goes_on(spells.back(), *found))
        spells.push_back({found->state, found->reason, frame.stamp, frame.stamp, frame.frame_id, frame.frame_id, 0});
      SensorSpell& spell = spells.back();
      spell.to = frame.stamp;
      spell.last_frame_id = frame.frame_id;
      ++spell.frames;
    }
    was_ok = is_ok;
  }
  return spells;
}

}  // namespace spartan
