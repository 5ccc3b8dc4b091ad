// Sums of smooth noise at many places at once.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "spartan/core/smooth_noise.h"

namespace spartan::sim {

/// Octaves of core's smooth noise, evaluated lane by lane: the same bits as the scalar functions on every instruction
/// set.
class NoiseSum {
 public:
  NoiseSum() = default;
  explicit NoiseSum(std::vector<Octave> octaves);

  /// Adds to sums[k] the octaves' values at (x[k], y[k]); all four of one length. An octave fades out as its lattice
  /// comes down to two footprints, where its mean over one is nothing: weight clamp(size / footprint_m[k] − 1, 0, 1).
  /// No footprints: all of every octave.
  void add_to(std::span<double> sums, std::span<const double> x, std::span<const double> y,
              std::span<const double> footprint_m = {}) const;
  double value(double x, double y) const;

 private:
  std::vector<Octave> octaves_;
};

}  // namespace spartan::sim
