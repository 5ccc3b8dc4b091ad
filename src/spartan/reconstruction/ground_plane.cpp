#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "spartan/reconstruction/v_disparity.h"

namespace spartan {
namespace {

constexpr std::size_t kMinBlocks = 8;  // least number of blocks that a plane is fitted to; empirical

// A block of the disparity image with its fitted plane d = disparity + gradient · (pixel − centre).
struct Block {
  Eigen::Vector2d centre;  // relative to the principal point, pixels
  Eigen::Vector2d gradient;
  double disparity = 0;
};

// Least squares over the known pixels of a block. None where more than a quarter of them is unknown, or where the
// residuals' RMS is larger than three standard deviations (not planar).
std::optional<Block> fit_block(ImageView<const float> disparity, int x0, int y0, int side, double sigma_px) {
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
  return Block{{x0 + half, y0 + half}, plane.head<2>(), plane.z()};
}

std::vector<Block> fit_blocks(ImageView<const float> disparity, const RectifiedStereo& g,
                              const GroundPlaneOptions& options) {
  std::vector<Block> blocks;
  const int side = options.block_px;
  for (int y = 0; y + side <= disparity.height(); y += side) {
    for (int x = 0; x + side <= disparity.width(); x += side) {
      auto block = fit_block(disparity, x, y, side, options.disparity_sigma_px);
      if (!block) continue;
      block->centre -= g.centre_px;
      blocks.push_back(*block);
    }
  }
  return blocks;
}

// The plane in space of a block, normal away from the ground: up ∝ −(f g_x, f g_y, d_c), d_c the disparity of the
// block's plane at the principal point.
GroundPlane plane_of(const RectifiedStereo& g, const Eigen::Vector2d& gradient, double at_centre) {
  const Eigen::Vector3d n(-gradient.x() * g.focal_px, -gradient.y() * g.focal_px, -at_centre);
  return {n.normalized(), g.focal_px * g.baseline_m / n.norm()};
}

// Mode of the values: the middle of the interval of length `width` that contains most of them.
double mode_of(std::vector<double> values, double width) {
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
  const std::vector<Block> all = fit_blocks(disparity, geometry, options);
  const double min_cosine = std::cos(options.max_tilt_deg * std::numbers::pi / 180);
  std::vector<Block> blocks;
  std::vector<double> inverse_heights;
  for (const Block& block : all) {
    const GroundPlane plane = plane_of(geometry, block.gradient, block.disparity - block.gradient.dot(block.centre));
    if (plane.up.dot(expected.up) < min_cosine) continue;
    blocks.push_back(block);
    inverse_heights.push_back(1 / plane.height_m);
  }
  if (blocks.size() < kMinBlocks || blocks.size() * 20 < all.size()) return std::nullopt;
  // Consensus: first the mode of the inverse heights (interval of a fifth of the expected one, inliers within 15 %,
  // empirical), then least squares over the inliers, repeated.
  const double inverse = mode_of(inverse_heights, 0.2 / expected.height_m);
  std::vector<char> inlier(blocks.size());
  for (std::size_t i = 0; i < blocks.size(); ++i) inlier[i] = std::abs(inverse_heights[i] - inverse) < 0.15 * inverse;
  GroundPlane plane;
  for (int round = 0; round < 6; ++round) {
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    int count = 0;
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      if (inlier[i] == 0) continue;
      const Eigen::Vector3d row(blocks[i].centre.x(), blocks[i].centre.y(), 1);
      // Relative errors are minimized, so that far blocks have as much weight as near ones.
      const double weight = 1 / (blocks[i].disparity * blocks[i].disparity);
      a += weight * row * row.transpose();
      b += weight * blocks[i].disparity * row;
      ++count;
    }
    if (count < static_cast<int>(kMinBlocks)) return std::nullopt;
    const Eigen::Vector3d fit = a.ldlt().solve(b);
    plane = plane_of(geometry, fit.head<2>(), fit.z());
    // Inliers lie within a tenth of the camera's height from the plane, in the last rounds within a twentieth;
    // empirical.
    const double gate = round < 3 ? 0.1 : 0.05;
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      const double d = fit.x() * blocks[i].centre.x() + fit.y() * blocks[i].centre.y() + fit.z();
      inlier[i] = d > 0 && std::abs(1 - d / blocks[i].disparity) < gate;
    }
  }
  return plane;
}

}  // namespace spartan
