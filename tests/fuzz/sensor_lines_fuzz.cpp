// Sensor samples as lines of text, in parts as they arrive.
#include <algorithm>
#include <cstdint>
#include <string_view>
#include <variant>

#include "spartan/camera/internal/sensor_lines.h"

using namespace spartan::internal;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::size_t part = data[0] % 64 + 1;
  const spartan::Stamp now{1'700'000'000'000'000'000};
  SensorLines lines("input", Eigen::Quaterniond::Identity());
  for (std::string_view left(reinterpret_cast<const char*>(data), size); !left.empty();) {
    lines.add(left.substr(0, part), {now, now});
    left.remove_prefix(std::min(part, left.size()));
  }
  while (const auto sample = lines.take()) {
    if (spartan::seconds_between(now, stamp_of(*sample)) > SensorLines::kAhead_s) __builtin_trap();
    if (const auto* imu = std::get_if<spartan::ImuSample>(&*sample)) {
      if (!imu->gyro_rad_s.allFinite() || !imu->accel_m_s2.allFinite()) __builtin_trap();
    }
  }
  return 0;
}
