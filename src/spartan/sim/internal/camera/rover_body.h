// The rover's own body in its cameras' view: deck, wheels, suspension, masts and camera housings.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/rig/rig.h"
#include "spartan/sim/internal/camera/ground_scene.h"
#include "spartan/sim/internal/world/rock_shape.h"
#include "spartan/sim/scenario_options.h"

namespace spartan::sim::internal {

/// Surfaces of the rover in the body frame.
struct RoverMesh {
  TriangleMesh mesh;
  std::vector<float> albedo;  ///< of each triangle
};

/// A camera of the rig in the body frame, where it is in one frame of the drive.
struct MountedCamera {
  Pose body_from_camera;
  bool on_pan_tilt_unit = false;
};

/// The rover as boxes and cylinders: four wheels, suspension arms between them, a deck behind the cameras on the body,
/// a mast below each pan-tilt unit, and a housing behind each camera.
RoverMesh make_rover_mesh(const ChassisOptions& chassis, const std::vector<PanTiltUnit>& units,
                          std::span<const MountedCamera> cameras);

/// The mesh as ray-traced geometry.
class RoverBody {
 public:
  /// Throws std::runtime_error where Embree does not start (no AVX2).
  explicit RoverBody(const RoverMesh& rover);
  RoverBody(RoverBody&&) noexcept;
  RoverBody& operator=(RoverBody&&) noexcept;
  ~RoverBody();

  /// body_from_origin for each ray of a packet, of the origin of the rays' coordinates.
  using Poses = std::array<const Pose*, kPacket>;

  /// Replaces hits of the ground by nearer ones of the rover: distance and normal. Returns the albedo of each ray that
  /// hits the rover, 0 for the others.
  std::array<float, kPacket> intersect(const RayPacket& rays, const Poses& body_from_origin, HitPacket& hits) const;
  /// Bit i: ray i hits the rover between 0 and its max_distance.
  std::uint32_t occluded(const RayPacket& rays, const Poses& body_from_origin) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace spartan::sim::internal
