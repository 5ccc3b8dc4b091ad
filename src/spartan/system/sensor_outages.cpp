#include <algorithm>
#include <string_view>

#include "spartan/system/run_store.h"

namespace spartan {
namespace {

std::string_view kind_of(std::string_view reason) {
  return reason.substr(0, reason.find_first_of(":0123456789"));
}

bool continues(const SensorOutage& outage, const LocalizationRecord::Sensor& sensor) {
  return outage.state == sensor.state && kind_of(outage.reason) == kind_of(sensor.reason);
}

}  // namespace

std::vector<SensorOutage> sensor_outages(const std::vector<FrameRecord>& frames, const std::string& sensor) {
  std::vector<SensorOutage> outages;
  bool was_ok = true;
  for (const FrameRecord& frame : frames) {
    if (!frame.localization) continue;
    const auto& sensors = frame.localization->sensors;
    const auto found = std::find_if(sensors.begin(), sensors.end(), [&](const auto& s) { return s.name == sensor; });
    if (found == sensors.end()) continue;
    const bool is_ok = found->state == "ok";
    if (!is_ok) {
      if (was_ok || !continues(outages.back(), *found))
        outages.push_back({found->state, found->reason, frame.stamp, frame.stamp, frame.frame_id, frame.frame_id, 0});
      SensorOutage& outage = outages.back();
      outage.to = frame.stamp;
      outage.last_frame_id = frame.frame_id;
      ++outage.frames;
    }
    was_ok = is_ok;
  }
  return outages;
}

}  // namespace spartan
