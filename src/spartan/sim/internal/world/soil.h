// Reflectance of the ground: albedo texture at every scale and the scattering law.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <utility>

#include "spartan/sim/internal/world/ground_cover.h"
#include "spartan/sim/internal/world/noise_sum.h"
#include "spartan/sim/internal/world/wheel_tracks.h"
#include "spartan/sim/scenario_options.h"

namespace spartan::sim::internal {

/// Albedo and scattering of soil and rocks; see SoilOptions for the model.
class Soil {
 public:
  Soil(const SoilOptions& options, std::uint64_t seed, GroundCover cover = {});

  /// Points on the ground or on rocks, and the diameter of the area that a sample of each covers, in metres.
  struct Places {
    std::span<const double> x, y, footprint_m;
  };
  /// Albedo of the ground; `albedo` has the length of `places`.
  void ground_albedo(const Places& places, std::span<double> albedo) const;
  /// Albedo of rocks. The caller mixes the height into x and y, so that steep faces have texture, too.
  void rock_albedo(const Places& places, std::span<double> albedo) const;
  /// Darkens the soil where wheels have been.
  void add_tracks(std::shared_ptr<const WheelTracks> tracks) { tracks_ = std::move(tracks); }
  /// Radiance towards the camera over the irradiance normal to the light's direction, times π, for albedo 1.
  double reflectance(double cos_incidence, double cos_emission) const;

  double mean_albedo() const { return options_.albedo; }

 private:
  void modulate(const Places& places, std::span<double> albedo) const;

  SoilOptions options_;
  GroundCover cover_;
  std::shared_ptr<const WheelTracks> tracks_;
  NoiseSum ground_, rock_, contrast_;
};

}  // namespace spartan::sim::internal
