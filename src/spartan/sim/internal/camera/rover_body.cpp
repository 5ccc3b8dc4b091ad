#include "spartan/sim/internal/camera/rover_body.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>

#include "spartan/sim/internal/camera/embree.h"

namespace spartan::sim::internal {
namespace {

constexpr float kDeckAlbedo = 0.5F, kWheelAlbedo = 0.15F, kArmAlbedo = 0.35F, kMastAlbedo = 0.4F, kHousingAlbedo = 0.1F;
constexpr double kSquare_m = 0.02;  // side of the squares of the surface pattern …
constexpr float kSquares = 0.15F;   // … and by how much they are brighter or darker
constexpr int kSides = 32;          // of a cylinder
constexpr double kDeckHeight_m = 0.1, kGap_m = 0.03;
constexpr double kMastRadius_m = 0.025, kBelowHead_m = 0.08;
constexpr double kHousing_m = 0.07;  // depth of a camera's housing

// Collects boxes and cylinders.
class MeshBuilder {
 public:
  // A box with these half edges around the origin of its frame.
  void add_box(const Pose& body_from_box, const Eigen::Vector3d& half_m, float albedo) {
    const auto first = static_cast<std::uint32_t>(rover_.mesh.vertices.size());
    for (int i = 0; i < 8; ++i) {
      const Eigen::Vector3d corner((i & 1) != 0 ? half_m.x() : -half_m.x(), (i & 2) != 0 ? half_m.y() : -half_m.y(),
                                   (i & 4) != 0 ? half_m.z() : -half_m.z());
      rover_.mesh.vertices.emplace_back((body_from_box * corner).cast<float>());
    }
    constexpr std::array<std::array<std::uint32_t, 4>, 6> kFaces{
        {{0, 1, 3, 2}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 3, 7, 5}}};
    for (const auto& [a, b, c, d] : kFaces) add_quad({first + a, first + b, first + c, first + d}, albedo);
  }

  // A cylinder along the z axis of its frame, centred at its origin.
  void add_cylinder(const Pose& body_from_cylinder, double radius_m, double length_m, float albedo) {
    const auto first = static_cast<std::uint32_t>(rover_.mesh.vertices.size());
    for (const double z : {-0.5 * length_m, 0.5 * length_m}) {
      rover_.mesh.vertices.emplace_back((body_from_cylinder * Eigen::Vector3d(0, 0, z)).cast<float>());
      for (int i = 0; i < kSides; ++i) {
        const double angle = 2 * std::numbers::pi * i / kSides;
        const Eigen::Vector3d rim(radius_m * std::cos(angle), radius_m * std::sin(angle), z);
        rover_.mesh.vertices.emplace_back((body_from_cylinder * rim).cast<float>());
      }
    }
    constexpr std::uint32_t kEnd = kSides + 1;
    for (std::uint32_t i = 0; i < kSides; ++i) {
      const std::uint32_t a = first + 1 + i, b = first + 1 + (i + 1) % kSides;
      add_quad({a, b, b + kEnd, a + kEnd}, albedo);
      add({first, a, b}, albedo);
      add({first + kEnd, a + kEnd, b + kEnd}, albedo);
    }
  }

  RoverMesh take() { return std::move(rover_); }

 private:
  void add(const std::array<std::uint32_t, 3>& triangle, float albedo) {
    rover_.mesh.triangles.push_back(triangle);
    rover_.albedo.push_back(albedo);
  }
  void add_quad(const std::array<std::uint32_t, 4>& corners, float albedo) {
    add({corners[0], corners[1], corners[2]}, albedo);
    add({corners[0], corners[2], corners[3]}, albedo);
  }
  RoverMesh rover_;
};

void add_wheels(MeshBuilder& builder, const ChassisOptions& c) {
  const Eigen::Quaterniond sideways(Eigen::AngleAxisd(0.5 * std::numbers::pi, Eigen::Vector3d::UnitX()));
  for (const double y : {0.5 * c.track_m, -0.5 * c.track_m}) {
    for (const double x : {0.5 * c.wheelbase_m, -0.5 * c.wheelbase_m})
      builder.add_cylinder(Pose(sideways, {x, y, c.wheel_radius_m}), c.wheel_radius_m, c.wheel_width_m, kWheelAlbedo);
    const double inside = y - std::copysign(0.5 * c.wheel_width_m + kGap_m, y);
    builder.add_box(Pose::from_translation({0, inside, c.wheel_radius_m + 0.04}), {0.5 * c.wheelbase_m, 0.012, 0.02},
                    kArmAlbedo);
  }
}

}  // namespace

RoverMesh make_rover_mesh(const ChassisOptions& c, const std::vector<PanTiltUnit>& units,
                          std::span<const MountedCamera> cameras) {
  MeshBuilder builder;
  add_wheels(builder, c);
  double front = 0.5 * c.wheelbase_m;
  for (const MountedCamera& camera : cameras) {
    if (!camera.on_pan_tilt_unit)
      front = std::min(front, camera.body_from_camera.translation().x() - kHousing_m - kGap_m);
    const double half = 0.5 * kHousing_m;
    builder.add_box(camera.body_from_camera * Pose::from_translation({0, 0, -half - 0.5 * kGap_m}), {0.02, 0.02, half},
                    kHousingAlbedo);
  }
  const double rear = -0.5 * c.wheelbase_m - c.wheel_radius_m;
  const double deck_m = 2 * c.wheel_radius_m + kGap_m;
  if (front > rear) {
    builder.add_box(Pose::from_translation({0.5 * (front + rear), 0, deck_m + 0.5 * kDeckHeight_m}),
                    {0.5 * (front - rear), 0.5 * (c.track_m - c.wheel_width_m) - kGap_m, 0.5 * kDeckHeight_m},
                    kDeckAlbedo);
  }
  for (const PanTiltUnit& unit : units) {
    const Eigen::Vector3d head = unit.body_from_base.translation();
    const double top = head.z() - kBelowHead_m, length = top - deck_m;
    if (length <= 0) continue;
    const double x = std::min(head.x(), front - kMastRadius_m);
    builder.add_cylinder(Pose::from_translation({x, head.y(), deck_m + 0.5 * length}), kMastRadius_m, length,
                         kMastAlbedo);
  }
  return builder.take();
}

struct RoverBody::State {
  EmbreeDevice device;
  EmbreeScene scene;
  std::vector<float> albedo;
};

RoverBody::RoverBody(const RoverMesh& rover) : state_(std::make_unique<State>()) {
  state_->device = make_embree_device(1);
  state_->scene = make_embree_scene(state_->device);
  state_->albedo = rover.albedo;
  RTCGeometry geometry = rtcNewGeometry(state_->device.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                               3 * sizeof(float), rover.mesh.vertices.size()));
  for (const Eigen::Vector3f& v : rover.mesh.vertices) vertices = std::copy_n(v.data(), 3, vertices);
  auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                 3 * sizeof(unsigned), rover.mesh.triangles.size()));
  for (const auto& triangle : rover.mesh.triangles) indices = std::copy_n(triangle.data(), 3, indices);
  attach(state_->scene, geometry);
  rtcCommitScene(state_->scene.get());
}

RoverBody::RoverBody(RoverBody&&) noexcept = default;
RoverBody& RoverBody::operator=(RoverBody&&) noexcept = default;
RoverBody::~RoverBody() = default;

namespace {

RayPacket in_body(const RayPacket& rays, const RoverBody::Poses& body_from_origin) {
  RayPacket moved;
  for (int k = 0; k < kPacket; ++k) {
    const Pose& pose = *body_from_origin[static_cast<std::size_t>(k)];
    const Eigen::Vector3d from(rays.origin_x[k], rays.origin_y[k], rays.origin_z[k]),
        along(rays.direction_x[k], rays.direction_y[k], rays.direction_z[k]);
    moved.set(k, (pose * from).cast<float>(), (pose.rotation() * along).cast<float>(), rays.max_distance[k]);
  }
  return moved;
}

// Lighter and darker squares, so that surfaces are not featureless.
float pattern(const Eigen::Vector3f& point) {
  const Eigen::Vector3d squares = point.cast<double>() / kSquare_m + Eigen::Vector3d::Constant(0.25);
  const auto sum = static_cast<int>(squares.array().floor().sum());
  return sum % 2 == 0 ? 1 - kSquares : 1 + kSquares;
}

}  // namespace

std::array<float, kPacket> RoverBody::intersect(const RayPacket& rays, const Poses& body_from_origin,
                                                HitPacket& hits) const {
  RayPacket moved = in_body(rays, body_from_origin);
  for (int k = 0; k < kPacket; ++k) moved.max_distance[k] = std::min(moved.max_distance[k], hits.distance[k]);
  RTCRayHit8 query;
  query.ray = embree_rays(moved);
  std::fill(std::begin(query.hit.geomID), std::end(query.hit.geomID), RTC_INVALID_GEOMETRY_ID);
  RTCIntersectContext context = coherent_rays();
  rtcIntersect8(kAllRays, state_->scene.get(), &context, &query);
  std::array<float, kPacket> albedo{};
  for (int k = 0; k < kPacket; ++k) {
    if (query.hit.geomID[k] == RTC_INVALID_GEOMETRY_ID) continue;
    const Eigen::Vector3f from(moved.origin_x[k], moved.origin_y[k], moved.origin_z[k]),
        along(moved.direction_x[k], moved.direction_y[k], moved.direction_z[k]);
    Eigen::Vector3f n = Eigen::Vector3f(query.hit.Ng_x[k], query.hit.Ng_y[k], query.hit.Ng_z[k]).normalized();
    if (n.dot(along) > 0) n = -n;
    n = body_from_origin[static_cast<std::size_t>(k)]->rotation().conjugate().cast<float>() * n;
    hits.distance[k] = query.ray.tfar[k];
    hits.normal_x[k] = n.x();
    hits.normal_y[k] = n.y();
    hits.normal_z[k] = n.z();
    hits.rock[k] = false;
    albedo[static_cast<std::size_t>(k)] =
        state_->albedo[query.hit.primID[k]] * pattern(from + query.ray.tfar[k] * along);
  }
  return albedo;
}

std::uint32_t RoverBody::occluded(const RayPacket& rays, const Poses& body_from_origin) const {
  return occluded_by(state_->scene, in_body(rays, body_from_origin));
}

}  // namespace spartan::sim::internal
