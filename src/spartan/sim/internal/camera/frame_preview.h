// Single rendered frames for measurements of the renderer and the sensor.
#pragma once

#include <cstddef>
#include <cstdint>

#include "spartan/core/frame_image.h"
#include "spartan/core/image.h"
#include "spartan/core/threads.h"
#include "spartan/sim/internal/camera/sensor.h"
#include "spartan/sim/simulator.h"

namespace spartan::sim::internal {

/// The left image of one frame.
struct FramePreview {
  FrameImage recorded;
  Image<float> noise_free;   ///< without noise and quantization, gray levels above black
  Image<std::uint8_t> soil;  ///< 255 where the point spread function covers nothing but soil
  Exposure exposure;
  double seconds = 0;  ///< rendering alone
  std::int64_t rays = 0;
};
/// Renders frame number `frame_index` of the request's drive without writing anything.
FramePreview preview_left(const SimulationRequest& request, std::size_t frame_index, const ThreadPool& workers);

}  // namespace spartan::sim::internal
