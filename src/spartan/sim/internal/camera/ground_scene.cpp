#include "spartan/sim/internal/camera/ground_scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>
#include <vector>

#include "spartan/sim/internal/camera/embree.h"
#include "spartan/sim/internal/world/rock_shape.h"

namespace spartan::sim::internal {
namespace {

constexpr double kOverlap_m = 0.5;     // overlap of the coarse ground with the fine one, so that no gaps open …
constexpr double kSunk_m = 0.02;       // … and its depth below it there, so that it stays hidden; empirical
constexpr double kRockEdge_m = 0.007;  // edge length of rocks in the region, about kGrid_m
constexpr double kFarRockEdge = 0.13;  // edge length over diameter, outside the region

// A rectangle of ground, one Embree grid geometry.
struct GridPlan {
  Region region;
  double step_m;
  double sunk_m;
};

// Slopes (∂z/∂x, ∂z/∂y) of the ground at the vertices of a grid, by central differences, and between them by bilinear
// interpolation. Normals of the facets instead would show the grid where the sun is low.
class SlopeGrid {
 public:
  SlopeGrid() = default;
  SlopeGrid(const float* vertices, int nx, int ny, double step_m, const ThreadPool& workers)
      : x0_(vertices[0]), y0_(vertices[1]), per_metre_(static_cast<float>(1 / step_m)), nx_(nx), ny_(ny) {
    slopes_.resize(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny));
    const auto height = [&](int i, int j) { return vertices[3 * at(i, j) + 2]; };
    workers.parallel_for(0, ny, 16, [&](int from, int to) {
      for (int j = from; j < to; ++j) {
        const int j0 = std::max(j - 1, 0), j1 = std::min(j + 1, ny_ - 1);
        for (int i = 0; i < nx_; ++i) {
          const int i0 = std::max(i - 1, 0), i1 = std::min(i + 1, nx_ - 1);
          slopes_[at(i, j)] = {per_metre_ * (height(i1, j) - height(i0, j)) / static_cast<float>(i1 - i0),
                               per_metre_ * (height(i, j1) - height(i, j0)) / static_cast<float>(j1 - j0)};
        }
      }
    });
  }

  /// Unit normal at a point of the ground; x, y as those of the vertices.
  Eigen::Vector3f normal(float x, float y) const {
    const float u = std::clamp((x - x0_) * per_metre_, 0.0F, static_cast<float>(nx_ - 1)),
                v = std::clamp((y - y0_) * per_metre_, 0.0F, static_cast<float>(ny_ - 1));
    const int i = std::min(static_cast<int>(u), nx_ - 2), j = std::min(static_cast<int>(v), ny_ - 2);
    const float a = u - static_cast<float>(i), b = v - static_cast<float>(j);
    const Eigen::Vector2f* const corner = &slopes_[at(i, j)];
    const Eigen::Vector2f below = corner[0] + a * (corner[1] - corner[0]),
                          above = corner[nx_] + a * (corner[nx_ + 1] - corner[nx_]);
    const Eigen::Vector2f slope = below + b * (above - below);
    return Eigen::Vector3f(-slope.x(), -slope.y(), 1).normalized();
  }

 private:
  std::size_t at(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(nx_) + static_cast<std::size_t>(i);
  }
  float x0_ = 0, y0_ = 0, per_metre_ = 0;
  int nx_ = 0, ny_ = 0;
  std::vector<Eigen::Vector2f> slopes_;
};

int steps_of(double length_m, double step_m) {
  return std::max(1, static_cast<int>(std::lround(length_m / step_m)));
}

// The region grown until its borders are multiples of the step.
Region snapped_to_lattice(const Region& r, double step_m) {
  return {std::floor(r.x0 / step_m) * step_m, std::floor(r.y0 / step_m) * step_m, std::ceil(r.x1 / step_m) * step_m,
          std::ceil(r.y1 / step_m) * step_m};
}

// All rocks in the region; around it those that cover more than a few pixels from there: over 5 cm up to 6 m away,
// over 25 cm up to 25 m (empirical).
std::vector<Rock> visible_rocks(const RockField& rocks, const Region& region) {
  constexpr double kNear_m = 6, kFar_m = 25;
  std::vector<Rock> chosen = rocks.rocks_in(region);
  for (const auto& [reach_m, smallest_m] : {std::pair{kNear_m, 0.05}, std::pair{kFar_m, 0.25}}) {
    for (const Rock& rock : rocks.rocks_in(region.grown(reach_m), smallest_m)) {
      const bool farther = reach_m == kNear_m || !region.grown(kNear_m).contains(rock.x, rock.y);
      if (farther && rock.diameter_m > smallest_m && !region.contains(rock.x, rock.y)) chosen.push_back(rock);
    }
  }
  return chosen;
}

}  // namespace

struct GroundScene::State {
  Region region;
  Eigen::Vector3d origin;
  EmbreeDevice device;
  EmbreeScene scene;
  std::size_t triangles = 0;
  unsigned rocks_id = RTC_INVALID_GEOMETRY_ID;
  std::vector<SlopeGrid> slopes;  // by geometry id of the ground

  State(const TerrainShape& shape, const Region& requested, const ThreadPool& workers);
  void add_ground(const TerrainShape& shape, const GridPlan& plan, const ThreadPool& workers);
  void add_rocks(const TerrainShape& shape, const std::vector<Rock>& rocks, const ThreadPool& workers);
};

void GroundScene::State::add_ground(const TerrainShape& shape, const GridPlan& plan, const ThreadPool& workers) {
  const Region r = snapped_to_lattice(plan.region, plan.step_m);
  if (!(r.x1 > r.x0) || !(r.y1 > r.y0)) return;
  const int nx = steps_of(r.x1 - r.x0, plan.step_m) + 1, ny = steps_of(r.y1 - r.y0, plan.step_m) + 1;
  RTCGeometry geometry = rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_GRID);
  auto* const vertices = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                              static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny)));
  auto* const grid = static_cast<RTCGrid*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_GRID, 0, RTC_FORMAT_GRID, sizeof(RTCGrid), 1));
  *grid = {0, static_cast<unsigned>(nx), static_cast<unsigned short>(nx), static_cast<unsigned short>(ny)};
  workers.parallel_for(0, ny, 8, [&](int from, int to) {
    const auto n = static_cast<std::size_t>(nx);
    std::vector<double> x(n), y(n), z(n);
    for (int i = 0; i < nx; ++i) x[static_cast<std::size_t>(i)] = r.x0 + plan.step_m * i;
    for (int j = from; j < to; ++j) {
      std::fill(y.begin(), y.end(), r.y0 + plan.step_m * j);
      shape.heights(x, y, z);
      float* v = vertices + 3 * static_cast<std::size_t>(j) * n;
      for (std::size_t i = 0; i < n; ++i, v += 3) {
        v[0] = static_cast<float>(x[i] - origin.x());
        v[1] = static_cast<float>(y[i] - origin.y());
        v[2] = static_cast<float>(z[i] - plan.sunk_m - origin.z());
      }
    }
  });
  triangles += 2 * static_cast<std::size_t>(nx - 1) * static_cast<std::size_t>(ny - 1);
  SlopeGrid grid_slopes(vertices, nx, ny, plan.step_m, workers);
  const unsigned id = attach(scene, geometry);
  slopes.resize(std::max(slopes.size(), static_cast<std::size_t>(id) + 1));
  slopes[id] = std::move(grid_slopes);
}

void GroundScene::State::add_rocks(const TerrainShape& shape, const std::vector<Rock>& rocks,
                                   const ThreadPool& workers) {
  if (rocks.empty()) return;
  std::vector<TriangleMesh> meshes(rocks.size());
  workers.parallel_for(0, static_cast<int>(rocks.size()), 64, [&](int from, int to) {
    for (int i = from; i < to; ++i) {
      const Rock& rock = rocks[static_cast<std::size_t>(i)];
      const double edge_m = region.contains(rock.x, rock.y) ? kRockEdge_m : kFarRockEdge * rock.diameter_m;
      meshes[static_cast<std::size_t>(i)] = place_rock(rock, shape, edge_m, origin);
    }
  });
  std::size_t vertex_count = 0, triangle_count = 0;
  for (const TriangleMesh& mesh : meshes) {
    vertex_count += mesh.vertices.size();
    triangle_count += mesh.triangles.size();
  }
  RTCGeometry geometry = rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), vertex_count));
  auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                 3 * sizeof(unsigned), triangle_count));
  unsigned first = 0;
  for (const TriangleMesh& mesh : meshes) {
    for (const Eigen::Vector3f& v : mesh.vertices) vertices = std::copy_n(v.data(), 3, vertices);
    for (const auto& triangle : mesh.triangles) {
      for (const std::uint32_t corner : triangle) *indices++ = first + corner;
    }
    first += static_cast<unsigned>(mesh.vertices.size());
  }
  triangles += triangle_count;
  rocks_id = attach(scene, geometry);
}

GroundScene::State::State(const TerrainShape& shape, const Region& requested, const ThreadPool& workers)
    : region(snapped_to_lattice(requested, kGrid_m)) {
  const double cx = 0.5 * (requested.x0 + requested.x1), cy = 0.5 * (requested.y0 + requested.y1);
  origin = {cx, cy, shape.height(cx, cy)};
  device = make_embree_device(workers.threads());
  scene = make_embree_scene(device);
}

GroundScene::GroundScene(std::unique_ptr<State> state) : state_(std::move(state)) {}

GroundScene::GroundScene(const TerrainShape& shape, const RockField& rocks, const Region& region,
                         const ThreadPool& workers)
    : state_(std::make_unique<State>(shape, region, workers)) {
  State& s = *state_;
  s.add_ground(shape, {s.region, kGrid_m, 0}, workers);
  Region inner = region.grown(-kOverlap_m);
  struct Ring {
    double reach_m, step_m;
  };
  for (const auto& [reach_m, step_m] : {Ring{10, 0.05}, Ring{kHorizon_m, 0.6}}) {
    const Region outer = region.grown(reach_m);
    s.add_ground(shape, {{outer.x0, outer.y0, outer.x1, inner.y0}, step_m, kSunk_m}, workers);
    s.add_ground(shape, {{outer.x0, inner.y1, outer.x1, outer.y1}, step_m, kSunk_m}, workers);
    s.add_ground(shape, {{outer.x0, inner.y0, inner.x0, inner.y1}, step_m, kSunk_m}, workers);
    s.add_ground(shape, {{inner.x1, inner.y0, outer.x1, inner.y1}, step_m, kSunk_m}, workers);
    inner = outer.grown(-kOverlap_m);
  }
  s.add_rocks(shape, visible_rocks(rocks, region), workers);
  rtcCommitScene(s.scene.get());
}

GroundScene GroundScene::rocks_only(const TerrainShape& shape, const RockField& rocks, const Region& region,
                                    const ThreadPool& workers) {
  auto state = std::make_unique<State>(shape, region.grown(2), workers);
  state->add_rocks(shape, rocks.rocks_in(region.grown(2), RockField::kLargestPebble_m), workers);
  rtcCommitScene(state->scene.get());
  return GroundScene(std::move(state));
}

GroundScene::GroundScene(GroundScene&&) noexcept = default;
GroundScene& GroundScene::operator=(GroundScene&&) noexcept = default;
GroundScene::~GroundScene() = default;

const Region& GroundScene::region() const {
  return state_->region;
}
const Eigen::Vector3d& GroundScene::origin() const {
  return state_->origin;
}
std::size_t GroundScene::triangles() const {
  return state_->triangles;
}

HitPacket GroundScene::intersect(const RayPacket& rays) const {
  RTCRayHit8 query;
  query.ray = embree_rays(rays);
  std::fill(std::begin(query.hit.geomID), std::end(query.hit.geomID), RTC_INVALID_GEOMETRY_ID);
  RTCIntersectContext context = coherent_rays();
  rtcIntersect8(kAllRays, state_->scene.get(), &context, &query);
  HitPacket hits;
  for (int i = 0; i < kPacket; ++i) {
    if (query.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) {
      hits.distance[i] = std::numeric_limits<float>::infinity();
      hits.normal_x[i] = hits.normal_y[i] = 0;
      hits.normal_z[i] = 1;
      hits.rock[i] = false;
      continue;
    }
    const unsigned id = query.hit.geomID[i];
    const Eigen::Vector3f direction(rays.direction_x[i], rays.direction_y[i], rays.direction_z[i]);
    Eigen::Vector3f n;
    if (id < state_->slopes.size()) {
      n = state_->slopes[id].normal(rays.origin_x[i] + query.ray.tfar[i] * direction.x(),
                                    rays.origin_y[i] + query.ray.tfar[i] * direction.y());
    } else {
      n = Eigen::Vector3f(query.hit.Ng_x[i], query.hit.Ng_y[i], query.hit.Ng_z[i]).normalized();
      if (n.dot(direction) > 0) n = -n;  // to face the ray, whatever the winding order of the triangle
    }
    hits.distance[i] = query.ray.tfar[i];
    hits.normal_x[i] = n.x();
    hits.normal_y[i] = n.y();
    hits.normal_z[i] = n.z();
    hits.rock[i] = query.hit.geomID[i] == state_->rocks_id;
  }
  return hits;
}

std::uint32_t GroundScene::occluded(const RayPacket& rays) const {
  return occluded_by(state_->scene, rays);
}

}  // namespace spartan::sim::internal
