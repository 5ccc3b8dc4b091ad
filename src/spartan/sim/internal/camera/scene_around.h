// What is rendered around one place of a drive.
#pragma once

#include <memory>

#include "spartan/core/threads.h"
#include "spartan/sim/internal/camera/ground_scene.h"
#include "spartan/sim/internal/camera/renderer.h"
#include "spartan/sim/internal/camera/sky_light.h"
#include "spartan/sim/internal/world/wheel_tracks.h"
#include "spartan/sim/internal/world/world.h"

namespace spartan::sim::internal {

/// A region of the world with its geometry and light, and the tracks of the rover, if any.
class SceneAround {
 public:
  SceneAround(const World& world, const Region& region, const std::shared_ptr<const WheelTracks>& tracks,
              const ThreadPool& workers)
      : world_(with_tracks(world, tracks)),
        scene_(world_.shape, world_.rocks, region, workers),
        sky_(scene_, world_.shape, workers) {}

  /// Borrows from this.
  LitScene lit() const { return {scene_, sky_, world_.sun, world_.soil, world_.sky_lux}; }

 private:
  static World with_tracks(World world, const std::shared_ptr<const WheelTracks>& tracks) {
    if (!tracks) return world;
    world.shape.add_tracks(tracks);
    world.soil.add_tracks(tracks);
    return world;
  }

  World world_;
  GroundScene scene_;
  SkyLight sky_;
};

}  // namespace spartan::sim::internal
