// The shape of the rock-free ground: a function of the plane, known everywhere.
#pragma once

#include <cstdint>
#include <span>

#include "spartan/core/options.h"
#include "spartan/sim/noise_sum.h"

namespace spartan::sim {

/// Relief is fractal: octaves of smooth noise from `relief_size_m` down to 2 cm whose amplitudes fall by `relief_gain`
/// from each to the next of half the size (0.5: self-similar with Hurst exponent 1). Ripples and dunes are wave trains
/// whose crests wander. Cavities are round pits with walls of a given steepness. A crater is a bowl
/// (a parabola) inside its crest and an apron outside that falls as the cube of the distance.
struct TerrainShapeOptions {
  double relief_m = 0.06;
  double relief_size_m = 8;
  double relief_gain = 0.42;
  double slope_deg = 0;
  double slope_heading_deg = 0;
  double ripple_height_m = 0.008;
  double ripple_length_m = 0.14;
  double dune_height_m = 0.1;
  double dune_length_m = 7;
  double cavities_per_100m2 = 0;
  double cavity_diameter_m = 0.6;
  double cavity_depth_m = 0.25;
  double crater_radius_m = 0;
  double crater_rim_m = 1;
  double crater_depth_m = 2;
  double crater_x_m = 0;
  double crater_y_m = 0;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("relief_m", relief_m, "standard deviation of the fractal relief", between(0, 5));
    v.field("relief_size_m", relief_size_m, "wavelength of its largest hills", between(0.1, 200));
    v.field("relief_gain", relief_gain, "amplitude of an octave over that of the next larger one", between(0.2, 0.9));
    v.field("slope_deg", slope_deg, "the whole ground rises by this angle", between(0, 30));
    v.field("slope_heading_deg", slope_heading_deg, "towards which it rises, counter-clockwise from x");
    v.field("ripple_height_m", ripple_height_m, "crest to trough of the wind ripples", between(0, 0.1));
    v.field("ripple_length_m", ripple_length_m, "from crest to crest", between(0.05, 2));
    v.field("dune_height_m", dune_height_m, "crest to trough of the dunes", between(0, 5));
    v.field("dune_length_m", dune_length_m, "from crest to crest", between(1, 100));
    v.field("cavities_per_100m2", cavities_per_100m2, "pits in the ground", between(0, 200));
    v.field("cavity_diameter_m", cavity_diameter_m, "of the largest; the smallest have half of it", between(0.1, 5));
    v.field("cavity_depth_m", cavity_depth_m, "of the largest", between(0, 3));
    v.field("crater_radius_m", crater_radius_m, "of one large crater, from its middle to the crest; 0: none",
            between(0, 200));
    v.field("crater_rim_m", crater_rim_m, "height of its crest over the plain", between(0, 50));
    v.field("crater_depth_m", crater_depth_m, "of its floor below the plain", between(0, 100));
    v.field("crater_x_m", crater_x_m, "its middle");
    v.field("crater_y_m", crater_y_m, "its middle");
  }
};

class TerrainShape {
 public:
  TerrainShape(const TerrainShapeOptions& options, std::uint64_t seed);

  /// Heights over the world plane at (x[k], y[k]), metres; all three of one length.
  void heights(std::span<const double> x, std::span<const double> y, std::span<double> heights) const;
  double height(double x, double y) const;
  /// Heights count from here on; 0 at first.
  void set_datum(double height_m) { datum_m_ += height_m; }
  /// How deep the cavity at this place is, 0 beside cavities: height() + this is the ground without them.
  double cavity_depth(double x, double y) const;

 private:
  void add_dunes(std::span<const double> x, std::span<const double> y, std::span<double> heights) const;
  double crater(double x, double y) const;
  void add_ripples(std::span<const double> x, std::span<const double> y, std::span<double> heights) const;

  TerrainShapeOptions options_;
  std::uint32_t seed_ = 0;
  NoiseSum relief_, ripple_wander_, ripple_strength_, dune_wander_;
  double slope_x_ = 0, slope_y_ = 0, datum_m_ = 0;
};

}  // namespace spartan::sim
