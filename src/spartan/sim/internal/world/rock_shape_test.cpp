#include "spartan/sim/internal/world/rock_shape.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

namespace spartan::sim::internal {
namespace {

// The area that a rock covers above level ground, seen from above, by vertical lines through its triangles.
double covered_area(const TriangleMesh& mesh, double step_m) {
  std::set<std::pair<int, int>> cells;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3d p = mesh.vertices[a].cast<double>(), q = mesh.vertices[b].cast<double>(),
                          r = mesh.vertices[c].cast<double>();
    const double area = (q - p).cross(r - p).z();
    if (std::abs(area) < 1e-15) continue;
    const auto cell = [&](double v) { return static_cast<int>(std::floor(v / step_m)); };
    for (int j = cell(std::min({p.y(), q.y(), r.y()})); j <= cell(std::max({p.y(), q.y(), r.y()})); ++j) {
      for (int i = cell(std::min({p.x(), q.x(), r.x()})); i <= cell(std::max({p.x(), q.x(), r.x()})); ++i) {
        const Eigen::Vector3d at((i + 0.5) * step_m, (j + 0.5) * step_m, 0);
        const double to_q = (at - p).cross(r - p).z() / area, to_r = (q - p).cross(at - p).z() / area;
        if (to_q < 0 || to_r < 0 || to_q + to_r > 1) continue;
        if (p.z() + to_q * (q - p).z() + to_r * (r - p).z() > 0) cells.insert({i, j});
      }
    }
  }
  return static_cast<double>(cells.size()) * step_m * step_m;
}

TEST(RockShape, CoversTheAreaOfItsDiameterAndHasItsHeight) {
  for (const bool buried : {false, true}) {
    for (const int layers : {0, 4}) {
      for (std::uint32_t shape = 1; shape < 12; ++shape) {
        Rock rock;
        rock.diameter_m = 0.05 * shape;
        rock.height_m = 0.4 * rock.diameter_m;
        rock.turn_rad = shape;
        rock.elongation = 1 + 0.05 * shape;
        rock.shape = shape;
        rock.buried = buried;
        rock.layers = layers;
        const TriangleMesh mesh = make_rock(rock, 0.007);
        const double wanted = std::numbers::pi / 4 * rock.diameter_m * rock.diameter_m;
        EXPECT_NEAR(covered_area(mesh, rock.diameter_m / 150) / wanted, 1, 0.03)
            << "shape " << shape << (buried ? ", buried" : "") << ", layers " << layers;
        float top = 0;
        for (const Eigen::Vector3f& v : mesh.vertices) top = std::max(top, v.z());
        EXPECT_NEAR(top, rock.height_m, 1e-6);
      }
    }
  }
}

// On a plane of any slope a placed rock is as high above the plane, everywhere, as on level ground.
TEST(RockShape, FollowsTheSlopeOfTheGround) {
  Rock rock;
  rock.x = 1.5;
  rock.y = -0.7;
  rock.diameter_m = 0.6;
  rock.height_m = 0.3;
  rock.shape = 3;
  const auto plane_of = [](double slope_deg) {
    TerrainShapeOptions options;
    options.slope_deg = slope_deg;
    options.slope_heading_deg = 30;
    options.relief_m = options.ripple_height_m = options.dune_height_m = 0;
    return TerrainShape(options, 1);
  };
  const TerrainShape level = plane_of(0), slope = plane_of(20);
  const auto heights_above = [&](const TerrainShape& ground) {
    std::vector<double> heights;
    for (const Eigen::Vector3f& v : place_rock(rock, ground, 0.02, Eigen::Vector3d::Zero()).vertices) {
      heights.push_back(static_cast<double>(v.z()) -
                        ground.height(static_cast<double>(v.x()), static_cast<double>(v.y())));
    }
    return heights;
  };
  const std::vector<double> on_level = heights_above(level), on_slope = heights_above(slope);
  ASSERT_EQ(on_level.size(), on_slope.size());
  for (std::size_t i = 0; i < on_level.size(); ++i) EXPECT_NEAR(on_slope[i], on_level[i], 1e-5);
}

}  // namespace
}  // namespace spartan::sim::internal
