#include "spartan/sim/internal/world/ground_cover.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "spartan/numerics/gradient_noise.h"
#include "spartan/sim/internal/world/smooth_step.h"

namespace spartan::sim::internal {
namespace {

constexpr std::size_t kPointBlock = 256;  // points evaluated together
constexpr double kPatchSize = 6;          // wavelength of the patches over the size of a slab
constexpr double kEdge = 0.04;            // width of a slab's edge over its size
constexpr double kMaxTilt = 0.06;         // slope of a slab's top
constexpr double kSlabShade = 0.3;        // range of the albedo between slabs
constexpr double kDriftSoftness = 0.35;   // width of a drift's edge in standard deviations of its noise
constexpr double kSiteSpread = 0.5;  // range of a site within its cell, over the cell: 3 × 3 cells hold the nearest two

// The value that noise of unit variance exceeds on a fraction `cover` of the plane. Sums of gradient noise are nearly
// normal: bisection of the error function.
double threshold_of(double cover) {
  double low = -6, high = 6;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (0.5 * std::erfc(middle / std::sqrt(2.0)) > cover ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

Slabs::Slabs(const SlabOptions& options, std::uint64_t seed)
    : options_(options),
      seed_(static_cast<std::uint32_t>(seed * 0x9E3779B9U)),
      threshold_(threshold_of(options.cover)),
      patches_(make_octaves(seed, 2, kPatchSize * options.size_m, 0.5, 1)) {}

Slabs::Point Slabs::at(double x, double y) const {
  if (none()) return {};
  const double u = x / options_.size_m, v = y / options_.size_m;
  const auto ix = static_cast<std::int32_t>(std::floor(u)), iy = static_cast<std::int32_t>(std::floor(v));
  struct Site {
    double distance = 1e9, x = 0, y = 0;
    std::int32_t i = 0, j = 0;
  };
  Site nearest, second;
  for (std::int32_t j = iy - 1; j <= iy + 1; ++j) {
    for (std::int32_t i = ix - 1; i <= ix + 1; ++i) {
      Site site{0, i + 0.5 + kSiteSpread * (hash_fraction(i, j, seed_) - 0.5),
                j + 0.5 + kSiteSpread * (hash_fraction(i, j, seed_ + 1) - 0.5), i, j};
      site.distance = std::hypot(u - site.x, v - site.y);
      if (site.distance < nearest.distance) {
        second = nearest;
        nearest = site;
      } else if (site.distance < second.distance) {
        second = site;
      }
    }
  }
  if (patches_.value(nearest.x * options_.size_m, nearest.y * options_.size_m) < threshold_) return {};
  const auto random = [&](std::uint32_t stream) { return hash_fraction(nearest.i, nearest.j, seed_ + stream) - 0.5; };
  Point point;
  point.cover = smooth_step(0.5 * (second.distance - nearest.distance) / kEdge);
  const double tilt_m = 2 * kMaxTilt * options_.size_m * ((u - nearest.x) * random(3) + (v - nearest.y) * random(4));
  point.height_m = point.cover * std::max(0.0, options_.height_m * (1 + random(2)) + tilt_m);
  point.shade = point.cover * random(5);
  return point;
}

GroundCover::GroundCover(const GroundCoverOptions& options, std::uint64_t seed)
    : options_(options),
      bedrock_(options.bedrock, seed + 31),
      crust_(options.crust, seed + 32),
      drifts_(make_octaves(seed + 33, 3, options.dust.size_m, 0.4, 1)),
      dust_threshold_(threshold_of(options.dust.cover)) {}

double GroundCover::dust_cover(double noise) const {
  return smooth_step(0.5 + (noise - dust_threshold_) / kDriftSoftness);
}

double GroundCover::dust_depth(double x, double y) const {
  if (options_.dust.cover <= 0) return 0;
  return options_.dust.depth_m * dust_cover(drifts_.value(x, y));
}

void GroundCover::add_heights(std::span<const double> x, std::span<const double> y, std::span<double> heights) const {
  if (none()) return;
  for (std::size_t k = 0; k < x.size(); ++k) {
    heights[k] += bedrock_.at(x[k], y[k]).height_m + crust_.at(x[k], y[k]).height_m + dust_depth(x[k], y[k]);
  }
}

void GroundCover::modulate(std::span<const double> x, std::span<const double> y, std::span<double> mean,
                           std::span<double> contrast) const {
  if (none()) return;
  const DustOptions& dust = options_.dust;
  std::array<double, kPointBlock> noise{};
  for (std::size_t from = 0; from < x.size(); from += kPointBlock) {
    const std::size_t n = std::min(kPointBlock, x.size() - from);
    std::fill_n(noise.begin(), n, 0.0);
    if (dust.cover > 0) drifts_.add_to(std::span(noise).first(n), x.subspan(from, n), y.subspan(from, n));
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t k = from + i;
      const double shade = bedrock_.at(x[k], y[k]).shade + crust_.at(x[k], y[k]).shade;
      const double cover = dust.cover > 0 ? dust_cover(noise[i]) : 0;
      mean[k] *= (1 + kSlabShade * shade * (1 - cover)) * (1 + (dust.albedo_ratio - 1) * cover);
      contrast[k] *= 1 + (dust.contrast_ratio - 1) * cover;
    }
  }
}

}  // namespace spartan::sim::internal
