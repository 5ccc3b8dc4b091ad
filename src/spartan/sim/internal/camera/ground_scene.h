// The ground around a place as ray-traced geometry (Embree).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "spartan/core/threads.h"
#include "spartan/sim/internal/world/region.h"
#include "spartan/sim/internal/world/rock_field.h"
#include "spartan/sim/internal/world/terrain_shape.h"

namespace spartan::sim::internal {

/// Number of rays in a packet; the rays of a packet should be coherent (similar origins and directions).
inline constexpr int kPacket = 8;

/// Rays in struct-of-arrays form: directions of unit length, distances in metres. A negative `max_distance` disables a
/// ray.
struct RayPacket {
  alignas(32) float origin_x[kPacket], origin_y[kPacket], origin_z[kPacket];
  alignas(32) float direction_x[kPacket], direction_y[kPacket], direction_z[kPacket];
  alignas(32) float max_distance[kPacket];

  void set(int k, const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float max_distance_m) {
    origin_x[k] = origin.x();
    origin_y[k] = origin.y();
    origin_z[k] = origin.z();
    direction_x[k] = direction.x();
    direction_y[k] = direction.y();
    direction_z[k] = direction.z();
    max_distance[k] = max_distance_m;
  }
};

/// The hits of a RayPacket.
struct HitPacket {
  alignas(32) float distance[kPacket];                                        ///< m; infinity without a hit
  alignas(32) float normal_x[kPacket], normal_y[kPacket], normal_z[kPacket];  ///< unit length; see GroundScene
  bool rock[kPacket];                                                         ///< true: a rock, false: the ground
};

/// Triangle scene of ground and rocks. Rays are relative to origin(), which is near enough for single precision.
/// Inside the region the ground is a grid of kGrid_m with all rocks; around it, coarser ground with the larger rocks
/// up to kHorizon_m. The triangles, not the functions that they sample, are the ground truth. Normals are those of the
/// triangles on rocks, and interpolated on the ground. Vertices lie on one lattice of the world, so two scenes agree
/// where their regions overlap.
class GroundScene {
 public:
  static constexpr double kGrid_m = 0.005;   ///< m; vertex spacing inside the region
  static constexpr double kHorizon_m = 120;  ///< m; extent of the ground around the region

  /// Throws std::runtime_error where Embree does not start (no AVX2).
  GroundScene(const TerrainShape& shape, const RockField& rocks, const Region& region, const ThreadPool& workers);
  /// The rocks alone, without ground and pebbles: all in the region and those that reach into it.
  static GroundScene rocks_only(const TerrainShape& shape, const RockField& rocks, const Region& region,
                                const ThreadPool& workers);
  GroundScene(GroundScene&&) noexcept;
  GroundScene& operator=(GroundScene&&) noexcept;
  ~GroundScene();

  /// The requested region, grown to the lattice.
  const Region& region() const;
  /// World coordinates of the rays' origin of coordinates.
  const Eigen::Vector3d& origin() const;
  /// The nearest hit of each ray.
  HitPacket intersect(const RayPacket& rays) const;
  /// Bit i: ray i hits something between 0 and its max_distance.
  std::uint32_t occluded(const RayPacket& rays) const;
  std::size_t triangles() const;

 private:
  struct State;
  explicit GroundScene(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace spartan::sim::internal
