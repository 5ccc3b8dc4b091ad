#include "spartan/system/internal/wheel_slip.h"

#include <algorithm>

namespace spartan::internal {

std::optional<WheelSlipSummary> wheel_slip_of(const std::vector<FrameRecord>& frames, double limit) {
  constexpr double kSigmas = 2;
  WheelSlipSummary summary;
  std::vector<double> slips;
  bool continues = false;
  for (const FrameRecord& frame : frames) {
    if (!frame.localization || !frame.localization->slip) continue;
    const double slip = *frame.localization->slip;
    slips.push_back(slip);
    if (slip - kSigmas * frame.localization->slip_sigma.value_or(0) <= limit) {
      continues = false;
      continue;
    }
    if (!continues) summary.alarms.push_back({frame.stamp, frame.stamp, slip});
    continues = true;
    SlipAlarm& alarm = summary.alarms.back();
    alarm.to = frame.stamp;
    alarm.largest = std::max(alarm.largest, slip);
  }
  if (slips.empty()) return std::nullopt;
  summary.largest = *std::max_element(slips.begin(), slips.end());
  const auto middle = slips.begin() + static_cast<std::ptrdiff_t>(slips.size() / 2);
  std::nth_element(slips.begin(), middle, slips.end());
  summary.median = *middle;
  return summary;
}

}  // namespace spartan::internal
