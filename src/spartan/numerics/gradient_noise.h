// Gradient (Perlin) noise in the plane, with its derivatives, and sums of octaves.
#pragma once

#include <cstdint>
#include <vector>

namespace spartan {

/// Hash of integer coordinates and a seed.
inline std::uint32_t hash_coordinates(std::int32_t x, std::int32_t y, std::uint32_t seed) {
  std::uint32_t h =
      (static_cast<std::uint32_t>(x) * 0x8da6b343U) ^ (static_cast<std::uint32_t>(y) * 0xd8163841U) ^ seed;
  h ^= h >> 16U;
  h *= 0x7feb352dU;
  h ^= h >> 15U;
  h *= 0x846ca68bU;
  return h ^ (h >> 16U);
}
/// The same as a fraction from 0 to 1.
inline double hash_fraction(std::int32_t x, std::int32_t y, std::uint32_t seed) {
  return hash_coordinates(x, y, seed) * 0x1p-32;
}

/// A function value and its gradient.
struct NoiseSample {
  double value = 0;
  double dx = 0, dy = 0;
};

/// Gradient noise on the integer lattice (Perlin, "Improving Noise", SIGGRAPH 2002: unit gradients, quintic fade):
/// twice continuously differentiable, mean 0, standard deviation kNoiseSigma, magnitude below kNoiseMaxValue, slope
/// below kNoiseMaxSlope, second derivatives below kNoiseMaxCurvature.
NoiseSample gradient_noise(double x, double y, std::uint32_t seed);
/// Number of gradient directions at the lattice points, and their kNoiseDirections unit vectors (x, y).
inline constexpr std::uint32_t kNoiseDirections = 64;
const double* noise_directions();
/// The value of gradient_noise() alone, with the same bits.
double gradient_noise_value(double x, double y, std::uint32_t seed);
inline constexpr double kNoiseSigma = 0.216;
inline constexpr double kNoiseMaxValue = 0.7072;
inline constexpr double kNoiseMaxSlope = 2.1;
inline constexpr double kNoiseMaxCurvature = 12;

/// One octave of a sum of gradient noise with lattice spacing `size`, rotated and shifted so that the lattices of
/// different octaves are not aligned.
struct Octave {
  double size = 1;
  double frequency = 1;  ///< 1 / size
  double amplitude = 1;  ///< factor of the noise
  double cosine = 1, sine = 0, shift_x = 0, shift_y = 0;
  std::uint32_t seed = 0;

  NoiseSample operator()(double x, double y) const;
  double value(double x, double y) const;
};

/// Makes `count` octaves of sizes `largest`, `largest`/2 …. Each amplitude is `gain` times the one before; the standard
/// deviation of the sum is `sigma`.
std::vector<Octave> make_octaves(std::uint64_t seed, int count, double largest, double gain, double sigma);

}  // namespace spartan
