// Meshes of rocks: angular bodies with a rough surface.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "spartan/sim/internal/world/rock_field.h"

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

}  // namespace spartan::sim::internal
