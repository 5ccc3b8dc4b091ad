#include "spartan/testing/synthetic_world.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "spartan/core/random.h"

namespace spartan::testing {
namespace {

constexpr double kFarthest_m = 100;
constexpr double kNear_m = 2e-3;  // what hides a point must stand farther from it
constexpr double kSkyLevel = 200;
constexpr double kAmbient = 0.35;  // share of the light that comes from the whole sky
const Eigen::Vector3d kSun = Eigen::Vector3d(-0.45, 0.55, 0.7).normalized();
// Sub-samples of a pixel; their mean is the box filter of a real pixel, to second order.
constexpr std::array<double, 2> kOffsets{-0.25, 0.25};

}  // namespace

/// A pinhole that looks at the world.
struct SyntheticWorld::Eye {
  ImageSize size;
  double focal_px;
  Eigen::Vector2d centre_px;
  Eigen::Vector3d origin;
  Eigen::Matrix3d world_from_eye;
  std::uint64_t number;  ///< 0 left, 1 right: the two have different noise

  /// Line of sight with optical z = 1, in world axes.
  Eigen::Vector3d sight(double u, double v) const {
    return world_from_eye * Eigen::Vector3d((u - centre_px.x()) / focal_px, (v - centre_px.y()) / focal_px, 1);
  }
};

struct SyntheticWorld::Surface {
  Eigen::Vector3d point, normal;
};

SyntheticWorld::SyntheticWorld(const SyntheticWorldOptions& options) : options_(options), terrain_(options) {}

double SyntheticWorld::height(double x, double y) const {
  return terrain_.ground(x, y).value;
}

double SyntheticWorld::relief(double x, double y) const {
  return terrain_.relief(x, y);
}

// Neighbouring rays go most of their way together: blocks of pixels share it.
Image<double> SyntheticWorld::measure_depth(const Eye& eye) const {
  constexpr int kBlock = 4;
  Image<double> depth(eye.size);
  const auto measure_block = [&](int u0, int v0, int u1, int v1) {
    const Eigen::Vector3d axis = eye.sight((u0 + u1) / 2.0, (v0 + v1) / 2.0).normalized();
    double spread = 0;
    for (const int u : {u0, u1}) {
      for (const int v : {v0, v1}) spread = std::max(spread, (eye.sight(u, v).normalized() - axis).norm());
    }
    const double clear = terrain_.clear_distance(eye.origin, axis, spread);
    for (int v = v0; v <= v1; ++v) {
      for (int u = u0; u <= u1; ++u) {
        const Eigen::Vector3d sight = eye.sight(u, v);
        const double length = sight.norm();
        depth(u, v) = terrain_.intersect(eye.origin, sight / length, kFarthest_m, clear).value_or(0) / length;
      }
    }
  };
  for (int v = 0; v < eye.size.height; v += kBlock) {
    for (int u = 0; u < eye.size.width; u += kBlock) {
      measure_block(u, v, std::min(u + kBlock, eye.size.width) - 1, std::min(v + kBlock, eye.size.height) - 1);
    }
  }
  return depth;
}

// What the right eye measures beside the point's place settles most cases; a ray of its own settles the rest.
bool SyntheticWorld::right_eye_sees(const Eye& right, ImageView<const double> right_depth, double u, int v,
                                    double depth) const {
  if (u < 0 || u > right.size.width - 1) return false;
  const int before = std::min(static_cast<int>(u), right.size.width - 2);
  const double a = depth / right_depth(before, v), b = depth / right_depth(before + 1, v);
  if (std::abs(a - 1) < 0.01 && std::abs(b - 1) < 0.01) return true;
  if (std::min(a, b) > 1.1) return false;
  const Eigen::Vector3d sight = right.sight(u, v);
  return !terrain_.intersect(right.origin, sight.normalized(), depth * sight.norm() - kNear_m);
}

double SyntheticWorld::reflected(const Eye& eye, const Surface& surface, double depth) const {
  // The same for both eyes, which stand at one height and measure one depth: both see the same grain.
  const double slant = depth / std::max(eye.origin.z() - surface.point.z(), 1e-3);
  const double footprint = depth / eye.focal_px * std::clamp(slant / 2, 1.0, 20.0);
  const double light = kAmbient + (1 - kAmbient) * std::max(0.0, surface.normal.dot(kSun)) / kSun.z();
  return options_.brightness * light * terrain_.albedo(surface.point.x(), surface.point.y(), footprint);
}

double SyntheticWorld::gray_level(const Eye& eye, int u, int v, double depth, bool at_edge) const {
  const auto surface_at = [&](const Eigen::Vector3d& point) {
    const NoiseSample ground = terrain_.ground(point.x(), point.y());
    return Surface{point, Eigen::Vector3d(-ground.dx, -ground.dy, 1).normalized()};
  };
  Surface centre{};
  if (!at_edge) centre = surface_at(eye.origin + depth * eye.sight(u, v));
  double sum = 0;
  for (const double dv : kOffsets) {
    for (const double du : kOffsets) {
      const Eigen::Vector3d sight = eye.sight(u + du, v + dv);
      if (!at_edge) {
        // Inside a pixel the ground is its tangent plane (off by curvature · (half a pixel)², micrometres).
        const double along = centre.normal.dot(centre.point - eye.origin) / centre.normal.dot(sight);
        sum += reflected(eye, {eye.origin + along * sight, centre.normal}, depth);
        continue;
      }
      const double length = sight.norm();
      const auto hit = terrain_.intersect(eye.origin, sight / length, kFarthest_m);
      sum += hit ? reflected(eye, surface_at(eye.origin + *hit / length * sight), *hit / length) : kSkyLevel;
    }
  }
  return sum / 4;
}

Image<std::uint8_t> SyntheticWorld::photograph(const Eye& eye, ImageView<const double> depth,
                                               std::uint64_t noise_seed) const {
  const int width = eye.size.width, height = eye.size.height;
  Image<std::uint8_t> picture(eye.size);
  // Inverse depth is affine over a plane; where it bends, the pixel may hold more than one surface.
  const auto bends = [&](int u, int v, int du, int dv) {
    const int u0 = std::max(u - du, 0), v0 = std::max(v - dv, 0);
    const int u1 = std::min(u + du, width - 1), v1 = std::min(v + dv, height - 1);
    const double before = depth(u0, v0), here = depth(u, v), after = depth(u1, v1);
    if (before <= 0 || here <= 0 || after <= 0) return true;
    if (u1 - u0 + v1 - v0 < 2) return false;
    return std::abs(here / before + here / after - 2) > 0.02;
  };
  for (int v = 0; v < height; ++v) {
    Random random(noise_seed, 2 * static_cast<std::uint64_t>(v) + eye.number);
    for (int u = 0; u < width; ++u) {
      const bool at_edge = bends(u, v, 1, 0) || bends(u, v, 0, 1);
      const double level = gray_level(eye, u, v, depth(u, v), at_edge) + options_.noise_levels * random.normal();
      picture(u, v) = static_cast<std::uint8_t>(std::lround(std::clamp(level, 0.0, 255.0)));
    }
  }
  return picture;
}

SyntheticShot SyntheticWorld::render(const RectifiedStereo& stereo, const Pose& world_from_left,
                                     std::uint64_t noise_seed) const {
  const Eigen::Matrix3d axes = world_from_left.rotation_matrix();
  const Eye left{stereo.size, stereo.focal_px, stereo.centre_px, world_from_left.translation(), axes, 0};
  const Eye right{stereo.size,
                  stereo.focal_px,
                  stereo.centre_px,
                  world_from_left * Eigen::Vector3d(stereo.baseline_m, 0, 0),
                  axes,
                  1};
  const Image<double> depth = measure_depth(left), right_depth = measure_depth(right);

  SyntheticShot shot{photograph(left, depth, noise_seed), photograph(right, right_depth, noise_seed),
                     Image<float>(stereo.size.width, stereo.size.height, std::numeric_limits<float>::quiet_NaN()),
                     Image<std::uint8_t>(stereo.size)};
  for (int v = 0; v < stereo.size.height; ++v) {
    for (int u = 0; u < stereo.size.width; ++u) {
      if (depth(u, v) <= 0) continue;
      const double disparity = stereo.focal_px * stereo.baseline_m / depth(u, v);
      shot.disparity(u, v) = static_cast<float>(disparity);
      shot.mask(u, v) = right_eye_sees(right, right_depth, u - disparity, v, depth(u, v)) ? 255 : 128;
    }
  }
  return shot;
}

}  // namespace spartan::testing
