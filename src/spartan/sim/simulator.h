// Simulates a drive into a recording.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>

#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/sim/scenario.h"
#include "spartan/sim/truth.h"

namespace spartan::sim {

struct SimulationRequest {
  Scenario scenario;
  Rig rig;      ///< the true one
  Drive drive;  ///< as plan_drive made it
  /// Of the believed rig's pairs; those that are missing get no true disparity.
  std::map<std::string, RectifiedView> views;
  std::string folder;
  bool resume = false;
};

struct SimulationProgress {
  int done = 0, shots = 0;
};

struct SimulationHooks {
  std::function<void(const SimulationProgress&)> progress;
  std::function<bool()> should_stop;
};

struct SimulationReport {
  std::int64_t frames = 0;  ///< written now or before
  std::int64_t rays = 0;    ///< cast from cameras, now
  double render_seconds = 0;
  bool interrupted = false;
};

/// Renders shot by shot; with `resume`, shots that are there already are kept. Codes: `output` (cannot be written, or
/// the folder is another's), `configuration` (the folder holds another scenario).
Result<SimulationReport> simulate(const SimulationRequest& request, const SimulationHooks& hooks,
                                  const Workers& workers);

/// One eye of one shot, for measurements: as recorded, the same without noise and rounding (gray levels over black),
/// and which pixels show nothing but soil within the point spread.
struct ShotPreview {
  FrameImage recorded;
  Image<float> noise_free;
  Image<std::uint8_t> soil;
  Exposure exposure;
  double seconds = 0;  ///< rendering alone
  std::int64_t rays = 0;
};
ShotPreview preview_left(const SimulationRequest& request, std::size_t shot, const Workers& workers);

/// The world that a scenario describes, set so that the body starts at height 0.
struct World {
  TerrainShape shape;
  RockField rocks;
  WheelLift wheel_lift;
  Soil soil;
  Sun sun;
  double sky_lux = 0;
};
World make_world(const Scenario& scenario, const Drive& drive);

}  // namespace spartan::sim
