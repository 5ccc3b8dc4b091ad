#include "spartan/sim/internal/world/soil.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

namespace spartan::sim::internal {
namespace {

constexpr double kLargest_m = 2.4;        // longest wavelength on soil
constexpr int kOctaves = 14;              // down to 0.3 mm
constexpr double kLargestOnRock_m = 0.3;  // longest wavelength on rock
constexpr int kOctavesOnRock = 11;        // down to 0.3 mm
constexpr double kTrackAlbedo = 0.85;     // albedo of soil turned up by wheels over that of other soil
constexpr std::size_t kShadedBlock = 64;  // points evaluated together
constexpr double kGainOnRock = 0.8;       // amplitude ratio of successive octaves on rock; empirical

// exp() to second order, which stays positive: a symmetric distribution of the logarithm makes bright grains rarer
// than dark ones.
double albedo_of(double mean, double v) {
  return mean * (1 + v + 0.5 * v * v);
}

}  // namespace

Soil::Soil(const SoilOptions& options, std::uint64_t seed, GroundCover cover)
    : options_(options),
      cover_(std::move(cover)),
      ground_(make_octaves(seed + 11, kOctaves, kLargest_m, options.octave_gain, options.contrast)),
      rock_(make_octaves(seed + 12, kOctavesOnRock, kLargestOnRock_m, kGainOnRock, options.contrast)),
      contrast_(make_octaves(seed + 13, 2, options.contrast_size_m, 0.5, options.contrast_spread)) {}

void Soil::ground_albedo(const Places& places, std::span<double> albedo) const {
  std::fill(albedo.begin(), albedo.end(), 0.0);
  ground_.add_to(albedo, places.x, places.y, places.footprint_m);
  if (options_.contrast_spread > 0 || !cover_.none()) {
    modulate(places, albedo);
  } else {
    for (double& a : albedo) a = albedo_of(options_.albedo, a);
  }
  for (std::size_t k = 0; tracks_ && k < albedo.size(); ++k) {
    if (tracks_->depth(places.x[k], places.y[k]) > 0) albedo[k] *= kTrackAlbedo;
  }
}

// Albedo from the values of the texture, where mean and contrast vary. The mean of the contrast stays the same: E
// exp(n) = exp(σ²/2) for normal n.
void Soil::modulate(const Places& places, std::span<double> albedo) const {
  std::array<double, kShadedBlock> mean{}, contrast{};
  for (std::size_t from = 0; from < albedo.size(); from += kShadedBlock) {
    const std::size_t n = std::min(kShadedBlock, albedo.size() - from);
    const auto x = places.x.subspan(from, n), y = places.y.subspan(from, n);
    std::fill_n(mean.begin(), n, options_.albedo);
    std::fill_n(contrast.begin(), n, -0.5 * options_.contrast_spread * options_.contrast_spread);
    contrast_.add_to(std::span(contrast).first(n), x, y);
    for (std::size_t i = 0; i < n; ++i) contrast[i] = std::exp(contrast[i]);
    cover_.modulate(x, y, std::span(mean).first(n), std::span(contrast).first(n));
    for (std::size_t i = 0; i < n; ++i) albedo[from + i] = albedo_of(mean[i], contrast[i] * albedo[from + i]);
  }
}

void Soil::rock_albedo(const Places& places, std::span<double> albedo) const {
  std::fill(albedo.begin(), albedo.end(), 0.0);
  rock_.add_to(albedo, places.x, places.y, places.footprint_m);
  for (double& a : albedo) a = albedo_of(options_.albedo * options_.rock_albedo_ratio, a);
}

double Soil::reflectance(double cos_incidence, double cos_emission) const {
  if (cos_incidence <= 0) return 0;
  const double emission = std::max(cos_emission, 0.0);
  const double l = options_.lunar_weight;
  return 2 * l * cos_incidence / (cos_incidence + emission + 1e-6) + (1 - l) * cos_incidence;
}

}  // namespace spartan::sim::internal
