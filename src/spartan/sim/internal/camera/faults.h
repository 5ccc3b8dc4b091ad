// Camera faults of a drive.
#pragma once

#include <cstdint>
#include <string>

#include "spartan/sim/internal/camera/sensor.h"
#include "spartan/sim/sensor_options.h"

namespace spartan::sim::internal {

/// Combined effect of all faults on one stereo frame.
struct FrameFaultState {
  bool dropped = false;
  ImageFault left, right;
  double left_jitter_s = 0, right_jitter_s = 0;  ///< recorded minus true time stamp
};

/// The effect of all faults on frame number `frame_index` of the drive, of a pair at a time. Random parts depend on
/// `frame_index` and the seed alone.
FrameFaultState fault_state(const CameraFaults& faults, const std::string& pair, double time_s,
                            std::uint64_t frame_index, std::uint64_t seed);

}  // namespace spartan::sim::internal
