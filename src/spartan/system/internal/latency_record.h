// Latencies of a live run: from the arrival of an image to the pose at it.
#pragma once

#include <chrono>
#include <vector>

namespace spartan::internal {

/// One value for each frame of the odometry pair, ms.
struct LatencyRecord {
  std::vector<float> all_ms;
  std::vector<float> at_stops_ms;  ///< those of frames while views of a stop were collected or its map was made

  std::vector<float> maps_ms;  ///< from leaving a stop to its map in the global map

  using Time = std::chrono::steady_clock::time_point;
  /// Returns the latency.
  float add(Time arrived, Time answered, bool at_stop) {
    const float ms = std::chrono::duration<float, std::milli>(answered - arrived).count();
    all_ms.push_back(ms);
    if (at_stop) at_stops_ms.push_back(ms);
    return ms;
  }
};

}  // namespace spartan::internal
