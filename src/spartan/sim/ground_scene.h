// The ground around a place as geometry that rays can meet (Embree).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "spartan/core/threads.h"
#include "spartan/sim/region.h"
#include "spartan/sim/rock_field.h"
#include "spartan/sim/terrain_shape.h"

namespace spartan::sim {

/// Rays go in packets of this many; a packet's rays should look alike.
inline constexpr int kPacket = 8;

/// Directions of unit length; distances in metres. `farthest` below zero switches a ray off.
struct RayPacket {
  alignas(32) float origin_x[kPacket], origin_y[kPacket], origin_z[kPacket];
  alignas(32) float direction_x[kPacket], direction_y[kPacket], direction_z[kPacket];
  alignas(32) float farthest[kPacket];

  void set(int k, const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float far) {
    origin_x[k] = origin.x();
    origin_y[k] = origin.y();
    origin_z[k] = origin.z();
    direction_x[k] = direction.x();
    direction_y[k] = direction.y();
    direction_z[k] = direction.z();
    farthest[k] = far;
  }
};

struct HitPacket {
  alignas(32) float distance[kPacket];                                        ///< infinity where nothing was met
  alignas(32) float normal_x[kPacket], normal_y[kPacket], normal_z[kPacket];  ///< of the triangle, unit length
  bool rock[kPacket];                                                         ///< else the ground
};

/// Coordinates of rays are relative to origin(), near enough for single precision.
/// Inside the region the ground is a grid of kGrid_m and every rock is there; around it, coarser ground with the larger
/// rocks up to kHorizon_m. What rays meet is the truth: the triangles, not the function they were made from. Corners
/// lie on one lattice of the world, so two scenes agree where their regions overlap.
class GroundScene {
 public:
  static constexpr double kGrid_m = 0.005;
  static constexpr double kHorizon_m = 120;

  GroundScene(const TerrainShape& shape, const RockField& rocks, const Region& region, const Workers& workers);
  /// The rocks alone, without pebbles: all of the region and those that reach into it.
  static GroundScene rocks_only(const TerrainShape& shape, const RockField& rocks, const Region& region,
                                const Workers& workers);
  GroundScene(GroundScene&&) noexcept;
  GroundScene& operator=(GroundScene&&) noexcept;
  ~GroundScene();

  /// The region asked for, widened to the lattice.
  const Region& region() const;
  const Eigen::Vector3d& origin() const;
  HitPacket intersect(const RayPacket& rays) const;
  /// Bit i: something lies between 0 and farthest of ray i.
  std::uint32_t occluded(const RayPacket& rays) const;
  std::size_t triangles() const;

 private:
  struct State;
  explicit GroundScene(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace spartan::sim
