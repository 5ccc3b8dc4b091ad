// Procedural ground with known height and albedo: hills, stones and a texture fixed to the world.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "spartan/numerics/gradient_noise.h"

namespace spartan::testing {

/// A height field z(x, y) over the world plane with a texture fixed to it; both are sums of gradient noise, so that
/// exact intersections and sub-pixel ground truth exist.
struct SyntheticWorldOptions {
  std::uint64_t seed = 1;
  double relief_m = 0.05;         ///< standard deviation of the height
  double relief_size_m = 1.0;     ///< wavelength of the largest hills
  double texture_size_m = 0.004;  ///< shortest wavelength of the texture
  double contrast = 0.25;         ///< standard deviation of the albedo over its mean
  double stones_per_m2 = 0;       ///< 0: none
  double stone_size_m = 0.15;     ///< diameter of the largest stones
  double brightness = 105;        ///< gray level of horizontal ground of mean albedo
  double noise_levels = 1.0;      ///< standard deviation of the image noise, gray levels
};

/// Height, albedo and ray intersections of the ground.
class SyntheticTerrain {
 public:
  explicit SyntheticTerrain(const SyntheticWorldOptions& options);

  /// Height of the hills without stones, metres.
  double relief(double x, double y) const;
  /// Height of the ground with stones in metres, and its gradient.
  NoiseSample ground(double x, double y) const;
  /// Relative albedo with mean about 1. Detail below `footprint_m`, the size of a pixel on the ground, is filtered out.
  double albedo(double x, double y, double footprint_m) const;

  /// Distance along the ray (unit direction) to the first intersection with the ground between `nearest` and
  /// `farthest`, to 1e-9 m.
  std::optional<double> intersect(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double farthest,
                                  double nearest = 0) const;
  /// A distance up to which no ray whose unit direction differs from `direction` by at most `spread` hits the ground.
  double clear_distance(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double spread) const;

 private:
  struct Stone;
  std::optional<Stone> stone_of_cell(double cell_x, double cell_y) const;
  std::optional<Stone> stone_at(double x, double y) const;
  double free_of_stones(double x, double y, double dx, double dy) const;

  SyntheticWorldOptions options_;
  std::vector<Octave> relief_, texture_;
  double stone_cell_m_ = 0;
  double relief_top_ = 0, stone_top_ = 0;  ///< upper bounds of the heights
  double steepest_ = 0, most_curved_ = 0;  ///< bounds of the hills' slope and curvature (1/m)
};

}  // namespace spartan::testing
