// When a sensor of the localization was not ok in a run.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "spartan/core/time.h"
#include "spartan/system/run_store.h"

namespace spartan {

/// Frames in a row for which a sensor was in one state, for one kind of reason.
struct SensorSpell {
  std::string state;
  std::string reason;  ///< of the first frame, with its figures
  Stamp from, to;      ///< of the first and of the last frame
  std::int64_t first_frame_id = 0, last_frame_id = 0;
  int frames = 0;
};

/// In the order of time. Reasons are of one kind where they say the same up to their figures. Shots that are missing
/// end no spell: nothing was judged there.
std::vector<SensorSpell> sensor_spells(const std::vector<FrameRecord>& frames, const std::string& sensor);

}  // namespace spartan
