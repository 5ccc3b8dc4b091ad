#include "spartan/sim/internal/world/soil.h"

#include <algorithm>
#include <cmath>

namespace spartan::sim::internal {
namespace {

constexpr double kLargest_m = 2.4;        // longest wavelength on soil
constexpr int kOctaves = 14;              // down to 0.3 mm
constexpr double kLargestOnRock_m = 0.3;  // longest wavelength on rock
constexpr int kOctavesOnRock = 11;        // down to 0.3 mm
constexpr double kGainOnRock = 0.8;       // amplitude ratio of successive octaves on rock; empirical

// exp() to second order, which stays positive: a symmetric distribution of the logarithm makes bright grains rarer
// than dark ones.
double albedo_of(double mean, double v) {
  return mean * (1 + v + 0.5 * v * v);
}

}  // namespace

Soil::Soil(const SoilOptions& options, std::uint64_t seed)
    : options_(options),
      ground_(make_octaves(seed + 11, kOctaves, kLargest_m, options.octave_gain, options.contrast)),
      rock_(make_octaves(seed + 12, kOctavesOnRock, kLargestOnRock_m, kGainOnRock, options.contrast)) {}

void Soil::ground_albedo(const Places& places, std::span<double> albedo) const {
  std::fill(albedo.begin(), albedo.end(), 0.0);
  ground_.add_to(albedo, places.x, places.y, places.footprint_m);
  for (double& a : albedo) a = albedo_of(options_.albedo, a);
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
