// How bright the ground is: albedo with detail at every scale, and the law by which it scatters light.
#pragma once

#include <cstdint>
#include <span>

#include "spartan/core/options.h"
#include "spartan/sim/noise_sum.h"

namespace spartan::sim {

/// Albedo is fixed to the world. Its variation is a sum of smooth noise from 2 m down to 0.3 mm; what is finer than the
/// place that a pixel covers is left out, as an eye would average it.
/// Scattering: Lunar–Lambert (McEwen, Icarus 1991), a mean of Lommel–Seeliger's and Lambert's laws by the weight L:
///   r = albedo (2 L μ₀ / (μ₀ + μ) + (1 − L) μ₀), μ₀ and μ the cosines of incidence and emission.
struct SoilOptions {
  double albedo = 0.2;
  double contrast = 0.14;
  double grain = 1.15;
  double rock_albedo_ratio = 0.8;
  double lunar_weight = 0.5;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("albedo", albedo, "mean", between(0.02, 0.9));
    v.field("contrast", contrast, "standard deviation of the albedo over its mean, all scales together",
            between(0, 0.6));
    v.field("grain", grain, "variation at one scale over that at twice the scale", between(0.5, 1.5));
    v.field("rock_albedo_ratio", rock_albedo_ratio, "albedo of rocks over that of the soil", between(0.1, 3));
    v.field("lunar_weight", lunar_weight, "L of the scattering law: 0 Lambert, 1 Lommel-Seeliger", between(0, 1));
  }
};

class Soil {
 public:
  Soil(const SoilOptions& options, std::uint64_t seed);

  /// Places on the ground and on the skins of rocks, and the size of what a sample of each stands for, metres.
  struct Places {
    std::span<const double> x, y, footprint_m;
  };
  /// Albedo of the ground; `albedo` has the places' length.
  void ground_albedo(const Places& places, std::span<double> albedo) const;
  /// Of rocks' skins. A caller lets x and y change with the height too, so that faces over each other differ.
  void rock_albedo(const Places& places, std::span<double> albedo) const;
  /// Share of the irradiance from one direction that is sent towards the eye, times π per steradian, for albedo 1.
  double scattered(double cos_incidence, double cos_emission) const;

  double mean_albedo() const { return options_.albedo; }

 private:
  SoilOptions options_;
  NoiseSum ground_, rock_;
};

}  // namespace spartan::sim
