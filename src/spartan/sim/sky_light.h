// How much of the sky each place of the ground sees.
#pragma once

#include <Eigen/Core>

#include "spartan/core/image.h"
#include "spartan/core/threads.h"
#include "spartan/sim/ground_scene.h"
#include "spartan/sim/region.h"
#include "spartan/sim/terrain_shape.h"

namespace spartan::sim {

/// The irradiance of a uniform sky on a surface, over that on open level ground. Baked for a scene and fixed to the
/// world: heights of ground and rocks from above on a grid of kStep_m; their horizons in kAzimuths directions (the
/// upper hull of the heights along each line of the grid; farther than the region, those of the ground without rocks);
/// per direction the sky between horizon and zenith, weighted by the cosine to the place's own mean normal,
///   ∫ (n_z sin e + n_a cos e) cos e de = n_z cos² h / 2 + n_a (π/2 − h − sin h cos h) / 2.
/// Kept is its ratio to that of an open plane of the same tilt, (1 + n_z)/2; between the grid's points it is
/// interpolated, and it is multiplied by the tilt of the facet that a ray meets. What hangs over is not known to it.
class SkyLight {
 public:
  static constexpr double kStep_m = 0.01;
  static constexpr int kAzimuths = 16;
  SkyLight(const GroundScene& scene, const TerrainShape& shape, const Workers& workers);

  /// At a place of the world (interpolated between points of the grid at its height), on a facet with this z of its
  /// normal; beyond the region that of an open plane.
  float share(const Eigen::Vector3d& place, float normal_z) const;

 private:
  Region region_;
  double base_m_ = 0;
  Image<float> heights_;  // over base_m_
  Image<float> open_;     // ratio to an open plane
};

}  // namespace spartan::sim
