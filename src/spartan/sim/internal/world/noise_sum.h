// Sums of octaves of gradient noise, vectorized over many points.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "spartan/numerics/gradient_noise.h"

namespace spartan::sim::internal {

/// Octaves of core's gradient noise, evaluated with SIMD: the same bits as the scalar functions on every instruction
/// set.
class NoiseSum {
 public:
  NoiseSum() = default;
  explicit NoiseSum(std::vector<Octave> octaves);

  /// Adds to sums[k] the value of all octaves at (x[k], y[k]); all four spans have the same length. An octave fades out
  /// as its lattice spacing comes down to the footprint, where its mean over the footprint vanishes: weight
  /// clamp(size / footprint_m[k] − 1, 0, 1). Without footprints every octave counts fully.
  void add_to(std::span<double> sums, std::span<const double> x, std::span<const double> y,
              std::span<const double> footprint_m = {}) const;
  double value(double x, double y) const;

 private:
  std::vector<Octave> octaves_;
};

}  // namespace spartan::sim::internal
