// Slip of the wheels over a run.
#pragma once

#include <optional>
#include <vector>

#include "spartan/core/time.h"
#include "spartan/system/run_store.h"

namespace spartan::internal {

/// Consecutive frames whose slip was beyond the limit.
struct SlipAlarm {
  Stamp from, to;      ///< of the first and the last of these frames
  double largest = 0;  ///< slip, 1 − travelled / counted
};

struct WheelSlipSummary {
  double median = 0, largest = 0;
  std::vector<SlipAlarm> alarms;
};

/// Nothing where no frame has a slip. Slip is beyond the limit where it is larger by two standard deviations; a frame
/// without a slip (a step too short for one) neither ends an alarm nor is part of it.
std::optional<WheelSlipSummary> wheel_slip_of(const std::vector<FrameRecord>& frames, double limit);

}  // namespace spartan::internal
