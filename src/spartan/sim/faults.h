// What goes wrong with pictures on a drive.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "spartan/core/options.h"
#include "spartan/sim/sensor.h"

namespace spartan::sim {

struct CameraFault {
  std::string kind = "dropped";
  std::string pair;
  double from_s = 0, to_s = 0;
  double amount = 0;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("kind", kind, "what goes wrong",
            {"dropped", "left_dark", "right_dark", "overexposed", "left_dust", "right_dust", "brightness_step",
             "stamp_jitter"});
    v.field("pair", pair, "of which pair; empty: all");
    v.field("from_s", from_s, "since the recording's start", at_least(0));
    v.field("to_s", to_s, "since the recording's start", at_least(0));
    v.field("amount", amount,
            "of overexposed and brightness_step: factor on the light that the exposure rule does not see; of "
            "stamp_jitter: standard deviation in seconds",
            at_least(0));
  }
};
using CameraFaults = std::vector<CameraFault>;

/// All faults of one shot together.
struct ShotFault {
  bool dropped = false;
  EyeFault left, right;
  double left_jitter_s = 0, right_jitter_s = 0;  ///< recorded minus true time
};

/// `shot` numbers the shots of a drive; chance depends on it and the seed alone.
ShotFault fault_of(const CameraFaults& faults, const std::string& pair, double time_s, std::uint64_t shot,
                   std::uint64_t seed);

}  // namespace spartan::sim
