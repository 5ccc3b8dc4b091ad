// Meshes of rocks: angular bodies with a rough surface.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "spartan/sim/internal/world/rock_field.h"
#include "spartan/sim/internal/world/terrain_shape.h"

namespace spartan::sim::internal {

struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// A sphere of 20 · 4^n triangles, cut by random planes and roughened by noise. Edges are about `edge_m` long where the
/// rock is large enough. World axes, relative to the rock's foot: z = 0 is the ground under its centre, its top is at
/// rock.height_m. Seen from above, what stands above the ground covers the area of a circle of rock.diameter_m. It
/// extends below the ground.
TriangleMesh make_rock(const Rock& rock, double edge_m);

/// The rock where it lies on the ground, relative to `origin` (world, m). A rock of at least kSeatedRock_m is sheared
/// by the slope of the ground under it, z' = z + slope · (x, y), so that on a slope no more of it overhangs than on
/// level ground.
TriangleMesh place_rock(const Rock& rock, const TerrainShape& ground, double edge_m, const Eigen::Vector3d& origin);
inline constexpr double kSeatedRock_m = 0.04;

}  // namespace spartan::sim::internal
