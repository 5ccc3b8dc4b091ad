#include "spartan/reconstruction/ground_plane.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace spartan {
namespace {

// A patch of the disparity image: its best plane d = at + gradient · (place − middle).
struct Patch {
  Eigen::Vector2d middle;  // relative to the centre of the image
  Eigen::Vector2d gradient;
  double at = 0;
};

// Least squares over the patch's known pixels; none where it has holes or is not flat.
std::optional<Patch> fit_patch(ImageView<const float> disparity, int x0, int y0, int side, double sigma_px) {
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double squares = 0;
  int count = 0;
  const double half = 0.5 * (side - 1);
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const double d = disparity(x0 + x, y0 + y);
      if (!(d > 0)) continue;
      const Eigen::Vector3d row(x - half, y - half, 1);
      a += row * row.transpose();
      b += d * row;
      squares += d * d;
      ++count;
    }
  }
  if (count < side * side * 3 / 4) return std::nullopt;
  const Eigen::Vector3d plane = a.ldlt().solve(b);
  const double rms = std::sqrt(std::max(0.0, squares - b.dot(plane)) / count);
  if (rms > 3 * sigma_px) return std::nullopt;
  return Patch{{x0 + half, y0 + half}, plane.head<2>(), plane.z()};
}

std::vector<Patch> fit_patches(ImageView<const float> disparity, const RectifiedStereo& g,
                               const GroundPlaneOptions& options) {
  std::vector<Patch> patches;
  const int side = options.block_px;
  for (int y = 0; y + side <= disparity.height(); y += side) {
    for (int x = 0; x + side <= disparity.width(); x += side) {
      auto patch = fit_patch(disparity, x, y, side, options.disparity_sigma_px);
      if (!patch) continue;
      patch->middle -= g.centre_px;
      patches.push_back(*patch);
    }
  }
  return patches;
}

// The normal of a patch, away from the ground: up ∝ −(f g_x, f g_y, d_c) with d_c its plane's disparity at the centre.
GroundPlane plane_of(const RectifiedStereo& g, const Eigen::Vector2d& gradient, double at_centre) {
  const Eigen::Vector3d n(-gradient.x() * g.focal_px, -gradient.y() * g.focal_px, -at_centre);
  return {n.normalized(), g.focal_px * g.baseline_m / n.norm()};
}

// The value where most of the sorted values lie within `width` of each other: the middle of those.
double densest(std::vector<double> values, double width) {
  std::sort(values.begin(), values.end());
  std::size_t best_from = 0, best_count = 0, to = 0;
  for (std::size_t from = 0; from < values.size(); ++from) {
    while (to < values.size() && values[to] <= values[from] + width) ++to;
    if (to - from > best_count) {
      best_count = to - from;
      best_from = from;
    }
  }
  return values[best_from + best_count / 2];
}

}  // namespace

double GroundPlane::pitch_rad() const {
  return std::asin(std::clamp(-up.z(), -1.0, 1.0));
}

double GroundPlane::roll_rad() const {
  return std::atan2(up.x(), -up.y());
}

std::optional<GroundPlane> find_ground_plane(ImageView<const float> disparity, const RectifiedStereo& geometry,
                                             const GroundPlane& expected, const GroundPlaneOptions& options) {
  const std::vector<Patch> all = fit_patches(disparity, geometry, options);
  const double turn = std::cos(options.steepest_deg * std::numbers::pi / 180);
  std::vector<Patch> patches;
  std::vector<double> inverse_heights;
  for (const Patch& patch : all) {
    const GroundPlane plane = plane_of(geometry, patch.gradient, patch.at - patch.gradient.dot(patch.middle));
    if (plane.up.dot(expected.up) < turn) continue;
    patches.push_back(patch);
    inverse_heights.push_back(1 / plane.height_m);
  }
  if (patches.size() < 8 || patches.size() * 20 < all.size()) return std::nullopt;
  // Where most agree, first in the plane's distance, then by least squares over those that lie near it.
  const double inverse = densest(inverse_heights, 0.2 / expected.height_m);
  std::vector<char> agrees(patches.size());
  for (std::size_t i = 0; i < patches.size(); ++i) agrees[i] = std::abs(inverse_heights[i] - inverse) < 0.15 * inverse;
  GroundPlane plane;
  for (int round = 0; round < 6; ++round) {
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    int count = 0;
    for (std::size_t i = 0; i < patches.size(); ++i) {
      if (agrees[i] == 0) continue;
      const Eigen::Vector3d row(patches[i].middle.x(), patches[i].middle.y(), 1);
      // By relative error: far patches count like near ones.
      const double weight = 1 / (patches[i].at * patches[i].at);
      a += weight * row * row.transpose();
      b += weight * patches[i].at * row;
      ++count;
    }
    if (count < 8) return std::nullopt;
    const Eigen::Vector3d fit = a.ldlt().solve(b);
    plane = plane_of(geometry, fit.head<2>(), fit.z());
    // Near: within a tenth of the height over the plane, later a twentieth.
    const double gate = round < 3 ? 0.1 : 0.05;
    for (std::size_t i = 0; i < patches.size(); ++i) {
      const double d = fit.x() * patches[i].middle.x() + fit.y() * patches[i].middle.y() + fit.z();
      agrees[i] = d > 0 && std::abs(1 - d / patches[i].at) < gate;
    }
  }
  return plane;
}

}  // namespace spartan
