#include "spartan/testing/synthetic_world.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "spartan/numerics/random.h"

namespace spartan::testing {
namespace {

constexpr double kFarthest_m = 100;
constexpr double kNear_m = 2e-3;  // occluders must be at least this far from the point
constexpr double kSkyLevel = 200;
constexpr double kAmbient = 0.35;  // fraction of the light that comes from the whole sky
const Eigen::Vector3d kSun = Eigen::Vector3d(-0.45, 0.55, 0.7).normalized();
// Supersampling offsets; the mean of the samples is a box filter over the pixel, to second order.
constexpr std::array<double, 2> kOffsets{-0.25, 0.25};

}  // namespace

/// A pinhole camera in the world.
struct SyntheticWorld::View {
  ImageSize size;
  double focal_px;
  Eigen::Vector2d centre_px;
  Eigen::Vector3d origin;
  Eigen::Matrix3d world_from_view;
  std::uint64_t number;  ///< 0 left, 1 right; selects the noise

  /// Ray direction with optical z = 1, in world axes.
  Eigen::Vector3d ray(double u, double v) const {
    return world_from_view * Eigen::Vector3d((u - centre_px.x()) / focal_px, (v - centre_px.y()) / focal_px, 1);
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

// Blocks of pixels share the free distance of the cone around them.
Image<double> SyntheticWorld::measure_depth(const View& view) const {
  constexpr int kBlock = 4;
  Image<double> depth(view.size);
  const auto measure_block = [&](int u0, int v0, int u1, int v1) {
    const Eigen::Vector3d axis = view.ray((u0 + u1) / 2.0, (v0 + v1) / 2.0).normalized();
    double spread = 0;
    for (const int u : {u0, u1}) {
      for (const int v : {v0, v1}) spread = std::max(spread, (view.ray(u, v).normalized() - axis).norm());
    }
    const double clear = terrain_.clear_distance(view.origin, axis, spread);
    for (int v = v0; v <= v1; ++v) {
      for (int u = u0; u <= u1; ++u) {
        const Eigen::Vector3d ray = view.ray(u, v);
        const double length = ray.norm();
        depth(u, v) = terrain_.intersect(view.origin, ray / length, kFarthest_m, clear).value_or(0) / length;
      }
    }
  };
  for (int v = 0; v < view.size.height; v += kBlock) {
    for (int u = 0; u < view.size.width; u += kBlock) {
      measure_block(u, v, std::min(u + kBlock, view.size.width) - 1, std::min(v + kBlock, view.size.height) - 1);
    }
  }
  return depth;
}

// Most cases follow from the right view's depth at the two pixels beside the projection; the others cast a ray.
bool SyntheticWorld::visible_in_right(const View& right, ImageView<const double> right_depth, double u, int v,
                                      double depth) const {
  if (u < 0 || u > right.size.width - 1) return false;
  const int before = std::min(static_cast<int>(u), right.size.width - 2);
  const double a = depth / right_depth(before, v), b = depth / right_depth(before + 1, v);
  if (std::abs(a - 1) < 0.01 && std::abs(b - 1) < 0.01) return true;
  if (std::min(a, b) > 1.1) return false;
  const Eigen::Vector3d ray = right.ray(u, v);
  return !terrain_.intersect(right.origin, ray.normalized(), depth * ray.norm() - kNear_m);
}

double SyntheticWorld::shade(const View& view, const Surface& surface, double depth) const {
  // The footprint is the same in both cameras, which have equal height and depth: both see the same texture.
  const double slant = depth / std::max(view.origin.z() - surface.point.z(), 1e-3);
  const double footprint = depth / view.focal_px * std::clamp(slant / 2, 1.0, 20.0);
  const double light = kAmbient + (1 - kAmbient) * std::max(0.0, surface.normal.dot(kSun)) / kSun.z();
  return options_.brightness * light * terrain_.albedo(surface.point.x(), surface.point.y(), footprint);
}

double SyntheticWorld::gray_level(const View& view, int u, int v, double depth, bool at_edge) const {
  const auto surface_at = [&](const Eigen::Vector3d& point) {
    const NoiseSample ground = terrain_.ground(point.x(), point.y());
    return Surface{point, Eigen::Vector3d(-ground.dx, -ground.dy, 1).normalized()};
  };
  Surface centre{};
  if (!at_edge) centre = surface_at(view.origin + depth * view.ray(u, v));
  double sum = 0;
  for (const double dv : kOffsets) {
    for (const double du : kOffsets) {
      const Eigen::Vector3d ray = view.ray(u + du, v + dv);
      if (!at_edge) {
        // Within a pixel the ground is approximated by its tangent plane (error: curvature · (half a pixel)²,
        // micrometres).
        const double along = centre.normal.dot(centre.point - view.origin) / centre.normal.dot(ray);
        sum += shade(view, {view.origin + along * ray, centre.normal}, depth);
        continue;
      }
      const double length = ray.norm();
      const auto hit = terrain_.intersect(view.origin, ray / length, kFarthest_m);
      sum += hit ? shade(view, surface_at(view.origin + *hit / length * ray), *hit / length) : kSkyLevel;
    }
  }
  return sum / 4;
}

Image<std::uint8_t> SyntheticWorld::render_image(const View& view, ImageView<const double> depth,
                                                 std::uint64_t noise_seed) const {
  const int width = view.size.width, height = view.size.height;
  Image<std::uint8_t> image(view.size);
  // Inverse depth is affine over a plane; elsewhere a pixel may cover more than one surface.
  const auto is_curved = [&](int u, int v, int du, int dv) {
    const int u0 = std::max(u - du, 0), v0 = std::max(v - dv, 0);
    const int u1 = std::min(u + du, width - 1), v1 = std::min(v + dv, height - 1);
    const double before = depth(u0, v0), here = depth(u, v), after = depth(u1, v1);
    if (before <= 0 || here <= 0 || after <= 0) return true;
    if (u1 - u0 + v1 - v0 < 2) return false;
    return std::abs(here / before + here / after - 2) > 0.02;
  };
  for (int v = 0; v < height; ++v) {
    Random random(noise_seed, 2 * static_cast<std::uint64_t>(v) + view.number);
    for (int u = 0; u < width; ++u) {
      const bool at_edge = is_curved(u, v, 1, 0) || is_curved(u, v, 0, 1);
      const double level = gray_level(view, u, v, depth(u, v), at_edge) + options_.noise_levels * random.normal();
      image(u, v) = static_cast<std::uint8_t>(std::lround(std::clamp(level, 0.0, 255.0)));
    }
  }
  return image;
}

SyntheticFrame SyntheticWorld::render(const RectifiedStereo& stereo, const Pose& world_from_left,
                                      std::uint64_t noise_seed) const {
  const Eigen::Matrix3d axes = world_from_left.rotation_matrix();
  const View left{stereo.size, stereo.focal_px, stereo.centre_px, world_from_left.translation(), axes, 0};
  const View right{stereo.size,
                   stereo.focal_px,
                   stereo.centre_px,
                   world_from_left * Eigen::Vector3d(stereo.baseline_m, 0, 0),
                   axes,
                   1};
  const Image<double> depth = measure_depth(left), right_depth = measure_depth(right);

  SyntheticFrame frame{render_image(left, depth, noise_seed), render_image(right, right_depth, noise_seed),
                       Image<float>(stereo.size.width, stereo.size.height, std::numeric_limits<float>::quiet_NaN()),
                       Image<std::uint8_t>(stereo.size)};
  for (int v = 0; v < stereo.size.height; ++v) {
    for (int u = 0; u < stereo.size.width; ++u) {
      if (depth(u, v) <= 0) continue;
      const double disparity = stereo.focal_px * stereo.baseline_m / depth(u, v);
      frame.disparity(u, v) = static_cast<float>(disparity);
      frame.mask(u, v) = visible_in_right(right, right_depth, u - disparity, v, depth(u, v)) ? 255 : 128;
    }
  }
  return frame;
}

}  // namespace spartan::testing
