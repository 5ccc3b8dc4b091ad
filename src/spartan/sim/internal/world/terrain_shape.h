// The shape of the ground without rocks: a procedural height function of the plane.
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

/// Height function; see TerrainShapeOptions and GroundCoverOptions for its parts.
class TerrainShape {
 public:
  TerrainShape(const TerrainShapeOptions& options, std::uint64_t seed, GroundCover cover = {});

  /// Heights in metres at (x[k], y[k]); all three spans have the same length.
  void heights(std::span<const double> x, std::span<const double> y, std::span<double> heights) const;
  double height(double x, double y) const;
  /// Makes `height_m` the new zero of all heights.
  void set_datum(double height_m) { datum_m_ += height_m; }
  /// Lowers the ground where wheels have been.
  void add_tracks(std::shared_ptr<const WheelTracks> tracks) { tracks_ = std::move(tracks); }
  /// Depth of the cavity at a point, 0 outside cavities: height() + this is the ground without cavities.
  double cavity_depth(double x, double y) const;

 private:
  void add_dunes(std::span<const double> x, std::span<const double> y, std::span<double> heights) const;
  double crater(double x, double y) const;
  void add_ripples(std::span<const double> x, std::span<const double> y, std::span<double> heights) const;

  TerrainShapeOptions options_;
  GroundCover cover_;
  std::shared_ptr<const WheelTracks> tracks_;
  std::uint32_t seed_ = 0;
  NoiseSum relief_, ripple_wander_, ripple_strength_, dune_wander_;
  double slope_x_ = 0, slope_y_ = 0, datum_m_ = 0, ripple_x_ = 0, ripple_y_ = 0;
};

}  // namespace spartan::sim::internal
