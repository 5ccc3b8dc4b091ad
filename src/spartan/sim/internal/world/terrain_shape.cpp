#include "spartan/sim/internal/world/terrain_shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include "spartan/core/pose.h"
#include "spartan/numerics/gradient_noise.h"
#include "spartan/numerics/random.h"
#include "spartan/sim/internal/world/smooth_step.h"

namespace spartan::sim::internal {
namespace {

constexpr double kFinestRelief_m = 0.02;  // shortest wavelength of the relief
constexpr std::size_t kBlock = 256;       // points evaluated together
constexpr double kWallFraction = 0.35;    // width of a cavity's wall over its radius; empirical

int octaves_down_to(double largest, double finest) {
  return std::max(1, static_cast<int>(std::ceil(std::log2(largest / finest))) + 1);
}

// A wave of unit height with crests sharper than troughs, as in aeolian ripples.
double crest(double phase) {
  const double s = 0.5 + 0.5 * std::sin(phase);
  return s * std::sqrt(s) - 0.5;
}

}  // namespace

TerrainShape::TerrainShape(const TerrainShapeOptions& options, std::uint64_t seed, GroundCover cover)
    : options_(options), cover_(std::move(cover)) {
  Random random(seed, 101);
  seed_ = random.next();
  const auto wander = [&](std::uint64_t stream, double size_m) {
    return NoiseSum(make_octaves(seed + stream, 1, size_m, 1, 1));
  };
  relief_ = NoiseSum(make_octaves(seed + 1, octaves_down_to(options.relief_size_m, kFinestRelief_m),
                                  options.relief_size_m, options.relief_gain, options.relief_m));
  ripple_wander_ = wander(2, 6 * options.ripple_length_m);
  ripple_strength_ = wander(3, 12 * options.ripple_length_m);
  dune_wander_ = wander(4, 3 * options.dune_length_m);
  const double rise = std::tan(options.slope_deg * kRadiansPerDegree);
  slope_x_ = rise * std::cos(options.slope_heading_deg * kRadiansPerDegree);
  slope_y_ = rise * std::sin(options.slope_heading_deg * kRadiansPerDegree);
  ripple_x_ = std::cos(options.ripple_heading_deg * kRadiansPerDegree);
  ripple_y_ = std::sin(options.ripple_heading_deg * kRadiansPerDegree);
}

void TerrainShape::add_dunes(std::span<const double> x, std::span<const double> y, std::span<double> heights) const {
  if (options_.dune_height_m <= 0) return;
  std::array<double, kBlock> wander{};
  dune_wander_.add_to(std::span(wander).first(x.size()), x, y);
  for (std::size_t k = 0; k < x.size(); ++k) {
    const double phase = 2 * std::numbers::pi * (0.8 * x[k] + 0.6 * y[k]) / options_.dune_length_m;
    heights[k] += options_.dune_height_m * crest(phase + 2.5 * wander[k]);
  }
}

void TerrainShape::add_ripples(std::span<const double> x, std::span<const double> y, std::span<double> heights) const {
  if (options_.ripple_height_m <= 0) return;
  std::array<double, kBlock> wander{}, strength{};
  ripple_wander_.add_to(std::span(wander).first(x.size()), x, y);
  ripple_strength_.add_to(std::span(strength).first(x.size()), x, y);
  for (std::size_t k = 0; k < x.size(); ++k) {
    const double phase = 2 * std::numbers::pi * (ripple_x_ * x[k] + ripple_y_ * y[k]) / options_.ripple_length_m;
    const double height_m = options_.ripple_height_m * smooth_step(0.5 + 0.6 * strength[k]);
    heights[k] += height_m * crest(phase + options_.ripple_wander_rad * wander[k]);
  }
}

// Smooth minimum of bowl and apron: the rim is rounded over a tenth of the radius, so that the slope is continuous.
double TerrainShape::crater(double x, double y) const {
  const double radius = options_.crater_radius_m;
  if (radius <= 0) return 0;
  const double r = std::hypot(x - options_.crater_x_m, y - options_.crater_y_m) / radius;
  const double bowl = -options_.crater_depth_m + (options_.crater_rim_m + options_.crater_depth_m) * r * r;
  const double apron = options_.crater_rim_m / std::max(r * r * r, 1e-3);
  const double softness = 0.05 * (options_.crater_rim_m + options_.crater_depth_m), gap = bowl - apron;
  return 0.5 * (bowl + apron - std::sqrt(gap * gap + softness * softness));
}

// Each cell of a lattice holds one cavity at a random offset, or none, at random.
double TerrainShape::cavity_depth(double x, double y) const {
  if (options_.cavities_per_100m2 <= 0) return 0;
  const double cell = std::max(std::sqrt(50.0 / options_.cavities_per_100m2), 2.2 * options_.cavity_diameter_m);
  const double probability = options_.cavities_per_100m2 / 100 * cell * cell;
  const auto ix = static_cast<std::int32_t>(std::floor(x / cell)), iy = static_cast<std::int32_t>(std::floor(y / cell));
  if (hash_fraction(ix, iy, seed_) >= probability) return 0;
  const double size = 0.5 + 0.5 * hash_fraction(ix, iy, seed_ + 1);
  const double radius = 0.5 * size * options_.cavity_diameter_m;
  const double max_offset = 0.5 * cell - 1.05 * radius;
  const double cx = (ix + 0.5) * cell + max_offset * (2 * hash_fraction(ix, iy, seed_ + 2) - 1);
  const double cy = (iy + 0.5) * cell + max_offset * (2 * hash_fraction(ix, iy, seed_ + 3) - 1);
  const double distance = std::hypot(x - cx, y - cy) / radius;
  return distance >= 1 ? 0 : size * options_.cavity_depth_m * smooth_step((1 - distance) / kWallFraction);
}

void TerrainShape::heights(std::span<const double> x, std::span<const double> y, std::span<double> heights) const {
  for (std::size_t from = 0; from < x.size(); from += kBlock) {
    const std::size_t n = std::min(kBlock, x.size() - from);
    const auto bx = x.subspan(from, n), by = y.subspan(from, n);
    const auto bz = heights.subspan(from, n);
    for (std::size_t k = 0; k < n; ++k) {
      bz[k] = slope_x_ * bx[k] + slope_y_ * by[k] - datum_m_ - cavity_depth(bx[k], by[k]) + crater(bx[k], by[k]);
    }
    relief_.add_to(bz, bx, by);
    add_dunes(bx, by, bz);
    add_ripples(bx, by, bz);
    cover_.add_heights(bx, by, bz);
    for (std::size_t k = 0; tracks_ && k < n; ++k) bz[k] -= tracks_->depth(bx[k], by[k]);
  }
}

double TerrainShape::height(double x, double y) const {
  double z = 0;
  heights({&x, 1}, {&y, 1}, {&z, 1});
  return z;
}

}  // namespace spartan::sim::internal
