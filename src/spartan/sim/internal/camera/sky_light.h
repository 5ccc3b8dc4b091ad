// Ambient occlusion: the part of the sky that each point of the ground sees.
#pragma once

#include <Eigen/Core>

#include "spartan/core/image.h"
#include "spartan/core/threads.h"
#include "spartan/sim/internal/camera/ground_scene.h"
#include "spartan/sim/internal/world/region.h"
#include "spartan/sim/internal/world/terrain_shape.h"

namespace spartan::sim::internal {

/// Sky view factor: the irradiance of a uniform sky on a surface over that on open level ground. Precomputed for a
/// scene on a grid fixed to the world: the heights of ground and rocks from above every kStep_m, and their horizons in
/// kAzimuths directions (upper convex hull of the heights along each line of the grid; beyond the region, heights of
/// the ground without rocks). Each direction contributes the sky between horizon h and zenith, weighted by the cosine
/// to the local mean normal,
///   ∫ (n_z sin e + n_a cos e) cos e de = n_z cos² h / 2 + n_a (π/2 − h − sin h cos h) / 2.
/// The grid stores the ratio of the sum to the value of an open plane of the same tilt, (1 + n_z)/2. It is interpolated
/// between grid points and multiplied by the tilt factor of the hit facet. A height field has no overhangs.
class SkyLight {
 public:
  static constexpr double kStep_m = 0.01;
  static constexpr int kAzimuths = 16;
  SkyLight(const GroundScene& scene, const TerrainShape& shape, const ThreadPool& workers);

  /// At a point in the world (interpolated between grid points of its height) on a facet whose normal has this z
  /// component; outside the region that of an open plane.
  float view_factor(const Eigen::Vector3d& point, float normal_z) const;

 private:
  Region region_;
  double base_m_ = 0;
  Image<float> heights_;               // above base_m_
  Image<float> relative_view_factor_;  // over that of an open plane
};

}  // namespace spartan::sim::internal
