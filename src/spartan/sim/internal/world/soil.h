// Reflectance of the ground: albedo texture at every scale and the scattering law.
#pragma once

#include <cstdint>
#include <span>

#include "spartan/sim/internal/world/noise_sum.h"
#include "spartan/sim/scenario_options.h"

namespace spartan::sim::internal {

/// Albedo and scattering of soil and rocks; see SoilOptions for the model.
class Soil {
 public:
  Soil(const SoilOptions& options, std::uint64_t seed);

  /// Points on the ground or on rocks, and the diameter of the area that a sample of each covers, in metres.
  struct Places {
    std::span<const double> x, y, footprint_m;
  };
  /// Albedo of the ground; `albedo` has the length of `places`.
  void ground_albedo(const Places& places, std::span<double> albedo) const;
  /// Albedo of rocks. The caller mixes the height into x and y, so that steep faces have texture, too.
  void rock_albedo(const Places& places, std::span<double> albedo) const;
  /// Radiance towards the camera over the irradiance normal to the light's direction, times π, for albedo 1.
  double reflectance(double cos_incidence, double cos_emission) const;

  double mean_albedo() const { return options_.albedo; }

 private:
  SoilOptions options_;
  NoiseSum ground_, rock_;
};

}  // namespace spartan::sim::internal
