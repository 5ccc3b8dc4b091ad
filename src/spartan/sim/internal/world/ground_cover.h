// What lies on the fine soil: slabs of bedrock, plates of crust, drifts of dust.
#pragma once

#include <cstdint>
#include <span>

#include "spartan/sim/internal/world/noise_sum.h"
#include "spartan/sim/scenario_options.h"

namespace spartan::sim::internal {

/// Flat slabs: cells of a Voronoi diagram (Worley, "A cellular texture basis function", SIGGRAPH 1996), present or
/// absent as a whole, in patches of several slabs.
class Slabs {
 public:
  Slabs() = default;
  Slabs(const SlabOptions& options, std::uint64_t seed);

  struct Point {
    double cover = 0;     ///< 1 on a slab, 0 beside it, between them at its edge
    double height_m = 0;  ///< above the soil
    double shade = 0;     ///< of the slab as a whole, −0.5 to 0.5
  };
  Point at(double x, double y) const;
  bool none() const { return options_.cover <= 0; }

 private:
  SlabOptions options_;
  std::uint32_t seed_ = 0;
  double threshold_ = 0;
  NoiseSum patches_;
};

/// Slabs, crust and dust of a world. All spans have the same length.
class GroundCover {
 public:
  GroundCover() = default;
  GroundCover(const GroundCoverOptions& options, std::uint64_t seed);

  /// Adds the height of what covers the soil at (x[k], y[k]) to heights[k].
  void add_heights(std::span<const double> x, std::span<const double> y, std::span<double> heights) const;
  /// Multiplies the mean albedo and the contrast of the soil at (x[k], y[k]) by those of what covers it.
  void modulate(std::span<const double> x, std::span<const double> y, std::span<double> mean,
                std::span<double> contrast) const;
  /// Depth of the dust at a point.
  double dust_depth(double x, double y) const;
  bool none() const { return options_.dust.cover <= 0 && bedrock_.none() && crust_.none(); }

 private:
  double dust_cover(double noise) const;

  GroundCoverOptions options_;
  Slabs bedrock_, crust_;
  NoiseSum drifts_;
  double dust_threshold_ = 0;
};

}  // namespace spartan::sim::internal
