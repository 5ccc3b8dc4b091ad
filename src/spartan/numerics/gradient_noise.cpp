#include "spartan/numerics/gradient_noise.h"

#include <array>
#include <cmath>
#include <numbers>

#include "spartan/numerics/random.h"

namespace spartan {
namespace {

struct Direction {
  double x, y;
};

const std::array<Direction, kNoiseDirections>& directions() {
  static const auto table = [] {
    std::array<Direction, kNoiseDirections> result{};
    for (std::size_t i = 0; i < result.size(); ++i) {
      const double angle = 2 * std::numbers::pi * static_cast<double>(i) / kNoiseDirections;
      result[i] = {std::cos(angle), std::sin(angle)};
    }
    return result;
  }();
  return table;
}

// std::floor is a library call on baseline x86-64 (no SSE4.1).
inline std::int32_t floor_of(double x) {
  const auto truncated = static_cast<std::int32_t>(x);
  return truncated - (x < truncated ? 1 : 0);
}

inline double fade(double t) {
  return t * t * t * (t * (t * 6 - 15) + 10);
}
inline double fade_slope(double t) {
  return 30 * t * t * (t * (t - 2) + 1);
}

/// The four lattice points around a point: gradients and their dot products with the offset to the point.
struct Corners {
  Direction g00, g10, g01, g11;
  double n00, n10, n01, n11;
  double tx, ty;
};

inline Corners corners_of(double x, double y, std::uint32_t seed) {
  const std::int32_t ix = floor_of(x), iy = floor_of(y);
  const double tx = x - ix, ty = y - iy;
  const auto& table = directions();
  const auto at = [&](std::int32_t cx, std::int32_t cy) {
    return table[hash_coordinates(cx, cy, seed) % kNoiseDirections];
  };
  Corners c{at(ix, iy), at(ix + 1, iy), at(ix, iy + 1), at(ix + 1, iy + 1), 0, 0, 0, 0, tx, ty};
  c.n00 = c.g00.x * tx + c.g00.y * ty;
  c.n10 = c.g10.x * (tx - 1) + c.g10.y * ty;
  c.n01 = c.g01.x * tx + c.g01.y * (ty - 1);
  c.n11 = c.g11.x * (tx - 1) + c.g11.y * (ty - 1);
  return c;
}

inline double blend(const Corners& c, double u, double v) {
  const double top = c.n00 + u * (c.n10 - c.n00);
  const double bottom = c.n01 + u * (c.n11 - c.n01);
  return top + v * (bottom - top);
}

}  // namespace

const double* noise_directions() {
  return &directions()[0].x;
}

double gradient_noise_value(double x, double y, std::uint32_t seed) {
  const Corners c = corners_of(x, y, seed);
  return blend(c, fade(c.tx), fade(c.ty));
}

NoiseSample gradient_noise(double x, double y, std::uint32_t seed) {
  const Corners c = corners_of(x, y, seed);
  const double u = fade(c.tx), v = fade(c.ty);
  const auto bilinear = [&](double a, double b, double d, double e) {
    return (1 - v) * (a + u * (b - a)) + v * (d + u * (e - d));
  };
  NoiseSample sample;
  sample.value = blend(c, u, v);
  sample.dx = bilinear(c.g00.x, c.g10.x, c.g01.x, c.g11.x) +
              fade_slope(c.tx) * ((1 - v) * (c.n10 - c.n00) + v * (c.n11 - c.n01));
  sample.dy = bilinear(c.g00.y, c.g10.y, c.g01.y, c.g11.y) +
              fade_slope(c.ty) * ((1 - u) * (c.n01 - c.n00) + u * (c.n11 - c.n10));
  return sample;
}

NoiseSample Octave::operator()(double x, double y) const {
  const double lx = (cosine * x - sine * y) * frequency + shift_x;
  const double ly = (sine * x + cosine * y) * frequency + shift_y;
  const NoiseSample local = gradient_noise(lx, ly, seed);
  const double slope = amplitude * frequency;
  return {amplitude * local.value, slope * (cosine * local.dx + sine * local.dy),
          slope * (cosine * local.dy - sine * local.dx)};
}

double Octave::value(double x, double y) const {
  const double lx = (cosine * x - sine * y) * frequency + shift_x;
  const double ly = (sine * x + cosine * y) * frequency + shift_y;
  return amplitude * gradient_noise_value(lx, ly, seed);
}

std::vector<Octave> make_octaves(std::uint64_t seed, int count, double largest, double gain, double sigma) {
  Random random(seed);
  std::vector<Octave> octaves(static_cast<std::size_t>(count));
  double power = 0;
  for (int i = 0; i < count; ++i) {
    Octave& octave = octaves[static_cast<std::size_t>(i)];
    const double angle = random.uniform(0, 2 * std::numbers::pi);
    octave.size = std::ldexp(largest, -i);
    octave.frequency = 1 / octave.size;
    octave.amplitude = std::pow(gain, i);
    octave.cosine = std::cos(angle);
    octave.sine = std::sin(angle);
    octave.shift_x = random.uniform(0, 1000);
    octave.shift_y = random.uniform(0, 1000);
    octave.seed = random.next();
    power += octave.amplitude * octave.amplitude;
  }
  for (Octave& octave : octaves) octave.amplitude *= sigma / (kNoiseSigma * std::sqrt(power));
  return octaves;
}

}  // namespace spartan
