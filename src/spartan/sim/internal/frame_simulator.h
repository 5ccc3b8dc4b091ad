// The frames of a simulated drive, one by one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "spartan/camera/sample_stream.h"
#include "spartan/camera/samples.h"
#include "spartan/core/threads.h"
#include "spartan/rig/rig.h"
#include "spartan/sim/internal/camera/faults.h"
#include "spartan/sim/internal/camera/frame_geometry.h"
#include "spartan/sim/internal/camera/frame_preview.h"
#include "spartan/sim/internal/camera/renderer.h"
#include "spartan/sim/internal/camera/scene_around.h"
#include "spartan/sim/internal/camera/sensor.h"
#include "spartan/sim/internal/camera/truth.h"
#include "spartan/sim/internal/drive/driven_poses.h"
#include "spartan/sim/internal/world/world.h"
#include "spartan/sim/simulator.h"

namespace spartan::sim::internal {

/// What takes the place of the plan and of the scenario's exposure rule.
struct FrameCommands {
  std::optional<Exposure> exposure;
  std::optional<PanTiltAngles> angles;
  /// A frame that is not planned: its pair, the middle of its exposure, and its number.
  struct Trigger {
    std::string pair;
    double time_s = 0;
    std::size_t number = 0;
  };
  std::optional<Trigger> trigger;
};

struct SimulatedFrame {
  StereoFrame frame;
  std::optional<TrueDisparity> truth;  ///< where the request has a view of the pair, and the scenario wants it
};

/// World, rover and cameras of a request, which it borrows.
class FrameSimulator {
 public:
  FrameSimulator(const SimulationRequest& request, const ThreadPool& workers);

  const World& world() const { return world_; }
  /// As the recording states it.
  const Rig& nominal() const { return nominal_; }
  /// As it is at the start.
  const Rig& rig() const { return rig_; }
  const BodyMotion& motion() const { return geometry_.motion(); }

  FrameFaultState fault_at(std::size_t i) const;
  Stamp left_stamp(std::size_t i, const FrameFaultState& fault) const;
  /// Renders frame number `i` of the drive, or at its place the one of `commands`; those that are near each other share
  /// a scene, if rendered in turn.
  SimulatedFrame render(std::size_t i, const FrameFaultState& fault, const FrameCommands& commands = {});
  FramePreview preview_left(std::size_t i) const;
  /// Camera rays cast so far.
  std::int64_t rays() const { return rays_; }

 private:
  struct PairRenderer;
  struct Scene {
    std::size_t from = 0, to = 0;          // frames
    std::optional<double> round_tilt_rad;  // for all pans of the mast at this tilt
    std::unique_ptr<SceneAround> around;
  };

  SensorIdentity identity_of(const Camera& camera) const;
  void make_pair_renderers();
  std::vector<DrivenPose> poses_of_wheel_tracks() const;
  std::size_t end_of_scene(std::size_t from) const;
  const SceneAround& scene_of(std::size_t i, std::optional<double> round_tilt_rad);
  SceneAround scene_around(std::size_t from, std::size_t to, std::optional<double> round_tilt_rad) const;
  Region region_of(std::size_t from, std::size_t to, std::optional<double> round_tilt_rad) const;
  const PlannedFrame& metered_frame(std::size_t i) const;
  Exposure exposure_for(const PlannedFrame& metered, const LitScene& lit) const;

  const SimulationRequest& request_;
  ThreadPool workers_;
  const Scenario& scenario_;
  World world_;
  Rig nominal_, rig_;
  FrameGeometry geometry_;
  std::vector<DrivenPose> driven_poses_;  // as close as wheel tracks need; empty: there are none
  std::map<std::string, std::shared_ptr<PairRenderer>> pair_renderers_;
  Scene scene_;
  std::int64_t rays_ = 0;
};

}  // namespace spartan::sim::internal
