// Intervals of a run in which a sensor of the localization was not ok.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "spartan/core/time.h"
#include "spartan/system/run_store.h"

namespace spartan {

/// Consecutive frames at which a sensor was in one state other than ok, for one kind of reason.
struct SensorOutage {
  std::string state;
  std::string reason;  ///< of the first frame, with its numbers
  Stamp from, to;      ///< of the first and of the last frame
  std::int64_t first_frame_id = 0, last_frame_id = 0;
  int frames = 0;
};

/// Outages of one sensor in time order. Two reasons are of one kind if they are equal up to their first colon or digit.
/// A missing frame has no sensor states, so it does not end an outage.
std::vector<SensorOutage> sensor_outages(const std::vector<FrameRecord>& frames, const std::string& sensor);

}  // namespace spartan
