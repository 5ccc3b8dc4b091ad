#include "spartan/sim/internal/world/rock_shape.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "spartan/numerics/gradient_noise.h"
#include "spartan/numerics/random.h"
#include "spartan/sim/internal/world/noise_sum.h"

namespace spartan::sim::internal {
namespace {

constexpr double kCentreHeight = 0.08;  // of the centre above the ground, over the height of the rock
constexpr int kPlanes = 14;             // random cutting planes

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

}  // namespace

TriangleMesh make_rock(const Rock& rock, double edge_m) {
  TriangleMesh mesh = sphere(subdivisions_for(rock.diameter_m, edge_m));
  const std::vector<double> radii = RockSurface(rock.shape).radii(mesh.vertices);
  for (std::size_t i = 0; i < radii.size(); ++i) mesh.vertices[i] *= static_cast<float>(radii[i]);
  // Scale to the requested height and diameter at the ground.
  float top = 0, foot = 0;
  for (const Eigen::Vector3f& v : mesh.vertices) top = std::max(top, v.z());
  const float ground = -top * static_cast<float>(kCentreHeight / (1 - kCentreHeight));
  int counted = 0;
  for (const Eigen::Vector3f& v : mesh.vertices) {
    if (std::abs(v.z() - ground) > 0.25F) continue;
    foot += v.head<2>().norm();
    ++counted;
  }
  const double wide = 0.5 * rock.diameter_m / (foot / static_cast<float>(counted));
  const double along = wide * std::sqrt(rock.elongation), across = wide / std::sqrt(rock.elongation);
  const double up = rock.height_m * (1 - kCentreHeight) / top;
  const double c = std::cos(rock.turn_rad), s = std::sin(rock.turn_rad);
  for (Eigen::Vector3f& v : mesh.vertices) {
    const double x = along * v.x(), y = across * v.y();
    v = Eigen::Vector3d(c * x - s * y, s * x + c * y, up * v.z() + kCentreHeight * rock.height_m).cast<float>();
  }
  return mesh;
}

}  // namespace spartan::sim::internal
