// Test fixture of the simulator's cameras: every triangle of ground and rocks, tested one by one in double precision.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "spartan/sim/internal/camera/ground_scene.h"
#include "spartan/sim/internal/world/rock_shape.h"

namespace spartan::sim::internal {

// A reference renderer without acceleration structure: every triangle, double precision.
class BruteForce {
 public:
  BruteForce(const TerrainShape& shape, const std::vector<Rock>& rocks, const Region& region) : shape_(shape) {
    constexpr double kStep = GroundScene::kGrid_m;
    const int nx = static_cast<int>(std::lround((region.x1 - region.x0) / kStep)),
              ny = static_cast<int>(std::lround((region.y1 - region.y0) / kStep));
    const auto corner = [&](int i, int j) {
      const double x = region.x0 + i * kStep, y = region.y0 + j * kStep;
      return Eigen::Vector3d(x, y, shape.height(x, y));
    };
    // Embree splits a cell of a grid along the diagonal from corner (1, 0) to (0, 1).
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        triangles_.push_back({corner(i, j), corner(i + 1, j), corner(i, j + 1), false});
        triangles_.push_back({corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1), false});
      }
    }
    for (const Rock& rock : rocks) {
      const Eigen::Vector3d foot(rock.x, rock.y, shape.height(rock.x, rock.y));
      const TriangleMesh mesh = place_rock(rock, shape, 0.007, foot);
      for (const auto& [a, b, c] : mesh.triangles) {
        triangles_.push_back({foot + mesh.vertices[a].cast<double>(), foot + mesh.vertices[b].cast<double>(),
                              foot + mesh.vertices[c].cast<double>(), true});
      }
    }
  }

  struct Hit {
    double distance = 1e9;
    Eigen::Vector3d normal;
    bool rock = false;
  };
  // Möller and Trumbore, "Fast, minimum storage ray/triangle intersection", 1997.
  Hit first(const Eigen::Vector3d& from, const Eigen::Vector3d& d, double nearest) const {
    Hit hit;
    for (const Triangle& t : triangles_) {
      const Eigen::Vector3d e1 = t.b - t.a, e2 = t.c - t.a, p = d.cross(e2);
      const double det = e1.dot(p);
      if (std::abs(det) < 1e-15) continue;
      const Eigen::Vector3d s = from - t.a;
      const double u = s.dot(p) / det;
      if (u < 0 || u > 1) continue;
      const Eigen::Vector3d q = s.cross(e1);
      const double v = d.dot(q) / det, along = e2.dot(q) / det;
      if (v < 0 || u + v > 1 || along < nearest || along > hit.distance) continue;
      hit = {along, e1.cross(e2).normalized(), t.rock};
    }
    if (hit.distance < 1e8 && !hit.rock) hit.normal = ground_normal(from + hit.distance * d);
    if (hit.normal.dot(d) > 0) hit.normal = -hit.normal;
    return hit;
  }

 private:
  // Slopes by central differences at the corners of the cell, and bilinear between them.
  Eigen::Vector3d ground_normal(const Eigen::Vector3d& at) const {
    constexpr double kStep = GroundScene::kGrid_m;
    const double u = at.x() / kStep, v = at.y() / kStep;
    Eigen::Vector3d normal(0, 0, 1);
    for (const double j : {std::floor(v), std::floor(v) + 1}) {
      for (const double i : {std::floor(u), std::floor(u) + 1}) {
        const double weight = (1 - std::abs(u - i)) * (1 - std::abs(v - j)), x = i * kStep, y = j * kStep;
        normal.x() -= weight * (shape_.height(x + kStep, y) - shape_.height(x - kStep, y)) / (2 * kStep);
        normal.y() -= weight * (shape_.height(x, y + kStep) - shape_.height(x, y - kStep)) / (2 * kStep);
      }
    }
    return normal.normalized();
  }

  const TerrainShape& shape_;
  struct Triangle {
    Eigen::Vector3d a, b, c;
    bool rock;
  };
  std::vector<Triangle> triangles_;
};

}  // namespace spartan::sim::internal
