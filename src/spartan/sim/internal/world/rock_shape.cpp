#include "spartan/sim/internal/world/rock_shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "spartan/numerics/gradient_noise.h"
#include "spartan/numerics/random.h"
#include "spartan/sim/internal/world/noise_sum.h"

namespace spartan::sim::internal {
namespace {

// Height of the ground at the rock over that of its top, both above the rock's centre.
constexpr float kGround = -0.087F;
constexpr float kGroundIfBuried = 0.4F;
constexpr float kLayerStep = 0.14F;  // by how much a layer stands out over the one below, over the radius
constexpr int kPlanes = 14;          // random cutting planes

TriangleMesh icosahedron() {
  const float g = 1.6180340F;
  TriangleMesh mesh;
  mesh.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                   {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  mesh.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                    {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                    {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (Eigen::Vector3f& v : mesh.vertices) v.normalize();
  return mesh;
}

TriangleMesh subdivided(const TriangleMesh& coarse) {
  TriangleMesh fine;
  fine.vertices = coarse.vertices;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto [entry, fresh] =
        middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(fine.vertices.size()));
    if (fresh) fine.vertices.push_back((fine.vertices[a] + fine.vertices[b]).normalized());
    return entry->second;
  };
  for (const auto& [a, b, c] : coarse.triangles) {
    const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    fine.triangles.insert(fine.triangles.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
  }
  return fine;
}

constexpr int kFinest = 6;

const TriangleMesh& sphere(int subdivisions) {
  static const std::array<TriangleMesh, kFinest + 1> spheres = [] {
    std::array<TriangleMesh, kFinest + 1> made;
    made[0] = icosahedron();
    for (std::size_t i = 1; i < made.size(); ++i) made[i] = subdivided(made[i - 1]);
    return made;
  }();
  return spheres[static_cast<std::size_t>(subdivisions)];
}

// The edge of an icosahedron is 0.53 times its diameter; each subdivision halves it.
int subdivisions_for(double diameter_m, double edge_m) {
  return std::clamp(static_cast<int>(std::lround(std::log2(0.53 * diameter_m / edge_m))), 1, kFinest);
}

// Radius of the rock in each direction: a sphere cut by planes, then roughened.
class RockSurface {
 public:
  explicit RockSurface(std::uint32_t shape) {
    Random random(shape, 3);
    for (auto& [normal, distance] : planes_) {
      normal = Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
      distance = random.uniform(0.68, 0.98);
    }
    for (NoiseSum& rough : rough_) rough = NoiseSum(make_octaves(random.next(), kRoughOctaves, 0.8, 0.6, 0.04));
  }

  /// Roughness is triplanar: noise on three planes, weighted by the squared component of the direction along each
  /// normal.
  std::vector<double> radii(const std::vector<Eigen::Vector3f>& directions) const {
    std::vector<double> radii(directions.size());
    for (std::size_t i = 0; i < radii.size(); ++i) radii[i] = cut(directions[i].cast<double>());
    std::vector<double> u(radii.size()), v(radii.size()), noise(radii.size());
    for (int axis = 0; axis < 3; ++axis) {
      for (std::size_t i = 0; i < radii.size(); ++i) {
        u[i] = 2.0 + directions[i][(axis + 1) % 3];
        v[i] = 2.0 + directions[i][(axis + 2) % 3];
      }
      std::fill(noise.begin(), noise.end(), 0.0);
      rough_[static_cast<std::size_t>(axis)].add_to(noise, u, v);
      for (std::size_t i = 0; i < radii.size(); ++i) {
        const double along = directions[i][axis];
        radii[i] += along * along * noise[i];
      }
    }
    return radii;
  }

 private:
  static constexpr int kRoughOctaves = 6;

  double cut(const Eigen::Vector3d& direction) const {
    double r = 1.0;
    for (const auto& [normal, distance] : planes_) {
      const double along = normal.dot(direction);
      if (along > 1e-3) r = std::min(r, distance / along);
    }
    return r;
  }

  std::array<std::pair<Eigen::Vector3d, double>, kPlanes> planes_;
  std::array<NoiseSum, 3> rough_;
};

// The outline of what stands above the ground, seen from above: its distance from the centre in each direction. Edges
// of the mesh cross directions at exact points.
class Outline {
 public:
  void add_triangle(const std::array<Eigen::Vector3f, 3>& corners, float ground) {
    std::array<Eigen::Vector3f, 2> cut;  // the ends of the line in which the ground cuts the triangle
    std::size_t cuts = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      Eigen::Vector3f from = corners[k], to = corners[(k + 1) % 3];
      if (from.z() > to.z()) std::swap(from, to);
      if (to.z() <= ground) continue;
      if (from.z() < ground) {
        from += (ground - from.z()) / (to.z() - from.z()) * (to - from);
        if (cuts < 2) cut[cuts++] = from;
      }
      add_edge(from, to);
    }
    if (cuts == 2) add_edge(cut[0], cut[1]);
  }
  double area() const {
    double sum = 0;
    for (std::size_t i = 0; i < radii_.size(); ++i) sum += radii_[i] * radii_[(i + 1) % radii_.size()];
    return 0.5 * std::sin(2 * std::numbers::pi / kDirections) * sum;
  }

 private:
  static constexpr int kDirections = 96;
  void add_edge(const Eigen::Vector3f& from, const Eigen::Vector3f& to) {
    const double start = direction_of(from);
    double turn = direction_of(to) - start;
    turn -= kDirections * std::round(turn / kDirections);
    const double low = std::min(start, start + turn), high = std::max(start, start + turn);
    const Eigen::Vector2d p = from.head<2>().cast<double>(), along = to.head<2>().cast<double>() - p;
    for (int i = static_cast<int>(std::ceil(low)); i <= static_cast<int>(std::floor(high)); ++i) {
      const double angle = 2 * std::numbers::pi * i / kDirections;
      const Eigen::Vector2d ray(std::cos(angle), std::sin(angle));
      // p + t along is parallel to the ray.
      const double across = ray.x() * along.y() - ray.y() * along.x();
      const double t = across == 0 ? 0 : std::clamp((ray.y() * p.x() - ray.x() * p.y()) / across, 0.0, 1.0);
      double& radius = radii_[static_cast<std::size_t>((i % kDirections + kDirections) % kDirections)];
      radius = std::max(radius, ray.dot(p + t * along));
    }
  }
  static double direction_of(const Eigen::Vector3f& v) {
    return std::atan2(static_cast<double>(v.y()), static_cast<double>(v.x())) * kDirections / (2 * std::numbers::pi);
  }
  std::array<double, kDirections> radii_{};
};

// The area that the mesh covers above the ground, seen from above.
double footprint(const TriangleMesh& mesh, float ground) {
  Outline outline;
  for (const auto& [a, b, c] : mesh.triangles)
    outline.add_triangle({mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]}, ground);
  return outline.area();
}

// Widens each layer towards its top.
void add_layers(TriangleMesh& mesh, int layers, float top) {
  for (Eigen::Vector3f& v : mesh.vertices) {
    const float layer = v.z() / top * static_cast<float>(layers);
    const float within = layer - std::floor(layer);
    v.head<2>() *= 1 + kLayerStep * (within * within - 0.5F);
  }
}

// Mean slope (∂z/∂x, ∂z/∂y) of the ground under a rock.
Eigen::Vector2d slope_under(const Rock& rock, const TerrainShape& ground) {
  const double reach = 0.5 * rock.diameter_m;
  const std::array<double, 4> x{rock.x + reach, rock.x - reach, rock.x, rock.x},
      y{rock.y, rock.y, rock.y + reach, rock.y - reach};
  std::array<double, 4> z{};
  ground.heights(x, y, z);
  return Eigen::Vector2d(z[0] - z[1], z[2] - z[3]) / rock.diameter_m;
}

}  // namespace

TriangleMesh make_rock(const Rock& rock, double edge_m) {
  TriangleMesh mesh = sphere(subdivisions_for(rock.diameter_m, edge_m));
  const std::vector<double> radii = RockSurface(rock.shape).radii(mesh.vertices);
  for (std::size_t i = 0; i < radii.size(); ++i) mesh.vertices[i] *= static_cast<float>(radii[i]);
  float top = 0;
  for (const Eigen::Vector3f& v : mesh.vertices) top = std::max(top, v.z());
  if (rock.layers > 0) add_layers(mesh, rock.layers, top);
  const float ground = top * (rock.buried ? kGroundIfBuried : kGround);
  const double wide = 0.5 * rock.diameter_m * std::sqrt(std::numbers::pi / footprint(mesh, ground));
  const double along = wide * std::sqrt(rock.elongation), across = wide / std::sqrt(rock.elongation);
  const double up = rock.height_m / static_cast<double>(top - ground);
  const double c = std::cos(rock.turn_rad), s = std::sin(rock.turn_rad);
  for (Eigen::Vector3f& v : mesh.vertices) {
    const double x = along * v.x(), y = across * v.y();
    v = Eigen::Vector3d(c * x - s * y, s * x + c * y, up * static_cast<double>(v.z() - ground)).cast<float>();
  }
  return mesh;
}

TriangleMesh place_rock(const Rock& rock, const TerrainShape& ground, double edge_m, const Eigen::Vector3d& origin) {
  TriangleMesh mesh = make_rock(rock, edge_m);
  const Eigen::Vector3f foot = (Eigen::Vector3d(rock.x, rock.y, ground.height(rock.x, rock.y)) - origin).cast<float>();
  Eigen::Vector2f slope = Eigen::Vector2f::Zero();
  if (rock.diameter_m >= kSeatedRock_m) slope = slope_under(rock, ground).cast<float>();
  for (Eigen::Vector3f& v : mesh.vertices) {
    v.z() += slope.dot(v.head<2>());
    v += foot;
  }
  return mesh;
}

}  // namespace spartan::sim::internal
