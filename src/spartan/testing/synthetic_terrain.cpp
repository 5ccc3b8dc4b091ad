#include "spartan/testing/synthetic_terrain.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace spartan::testing {
namespace {

constexpr int kReliefOctaves = 3, kTextureOctaves = 7;
constexpr double kReliefGain = 0.3;
constexpr double kWavelengthPerLattice = 1.5;  // wavelength of most power of gradient noise, in lattice steps
constexpr double kStoneHeightPerRadius = 0.55;
constexpr double kStoneSlope =
    2.43 * kStoneHeightPerRadius / 0.7;  // largest slope of (1 − q⁴)², for the shortest half axis
constexpr double kStoneProbability = 0.7;

double fraction(std::uint32_t bits) {
  return (bits & 0xffffU) / 65536.0;
}

void add(NoiseSample& sum, const NoiseSample& part) {
  sum.value += part.value;
  sum.dx += part.dx;
  sum.dy += part.dy;
}

}  // namespace

/// One stone: height ∝ (1 − q⁴)² over an ellipse, where q is 1 on its rim.
struct SyntheticTerrain::Stone {
  double x, y, half_long, half_short, cosine, sine, height, tone;

  /// q⁴ and its gradient.
  NoiseSample rim(double px, double py) const {
    const double a = (cosine * (px - x) + sine * (py - y)) / half_long;
    const double b = (cosine * (py - y) - sine * (px - x)) / half_short;
    const double q2 = a * a + b * b;
    const double ga = 4 * q2 * a / half_long, gb = 4 * q2 * b / half_short;
    return {q2 * q2, cosine * ga - sine * gb, sine * ga + cosine * gb};
  }
  NoiseSample surface(double px, double py) const {
    const NoiseSample q4 = rim(px, py);
    if (q4.value >= 1) return {};
    const double rest = 1 - q4.value, slope = -2 * height * rest;
    return {height * rest * rest, slope * q4.dx, slope * q4.dy};
  }
  bool around(double px, double py) const { return (px - x) * (px - x) + (py - y) * (py - y) <= half_long * half_long; }
};

SyntheticTerrain::SyntheticTerrain(const SyntheticWorldOptions& options) : options_(options) {
  relief_ = make_octaves(options.seed * 2 + 1, kReliefOctaves, options.relief_size_m / kWavelengthPerLattice,
                         kReliefGain, options.relief_m);
  texture_ = make_octaves(options.seed * 2 + 2, kTextureOctaves,
                          std::ldexp(options.texture_size_m, kTextureOctaves - 1), 1.0, options.contrast);
  double slope_squares = 0, curvature_squares = 0;
  for (const Octave& octave : relief_) {
    relief_top_ += octave.amplitude * kNoiseMaxValue;
    slope_squares += std::pow(octave.amplitude / octave.size * kNoiseMaxSlope, 2);
    curvature_squares += std::pow(octave.amplitude / (octave.size * octave.size) * kNoiseMaxCurvature, 2);
  }
  // The octaves do not have their extremes at the same points: the root of the sum of squares is a sufficient bound.
  steepest_ = std::sqrt(slope_squares);
  most_curved_ = std::sqrt(curvature_squares);
  if (options.stones_per_m2 > 0) {
    stone_cell_m_ = std::max(std::sqrt(kStoneProbability / options.stones_per_m2), options.stone_size_m);
    stone_top_ = kStoneHeightPerRadius * options.stone_size_m / 2;
  }
}

// A stone lies wholly inside its cell, so that only one cell has to be searched.
std::optional<SyntheticTerrain::Stone> SyntheticTerrain::stone_of_cell(double cell_x, double cell_y) const {
  const auto seed = static_cast<std::uint32_t>(options_.seed * 3);
  const std::uint32_t first =
      hash_coordinates(static_cast<std::int32_t>(cell_x), static_cast<std::int32_t>(cell_y), seed);
  if (fraction(first) > kStoneProbability) return std::nullopt;
  const std::uint32_t second = hash_coordinates(static_cast<std::int32_t>(first), 1, seed);
  const std::uint32_t third = hash_coordinates(static_cast<std::int32_t>(first), 2, seed);
  const double small = fraction(first >> 16U);
  Stone stone{};
  stone.half_long = options_.stone_size_m / 2 * (0.3 + 0.7 * small * small);  // mostly small
  stone.half_short = stone.half_long * (0.7 + 0.3 * fraction(second >> 16U));
  stone.height = kStoneHeightPerRadius * stone.half_long * (0.6 + 0.4 * fraction(third));
  const double free_width = stone_cell_m_ - 2 * stone.half_long;
  stone.x = cell_x * stone_cell_m_ + stone.half_long + free_width * fraction(third >> 16U);
  stone.y = cell_y * stone_cell_m_ + stone.half_long + free_width * fraction(second >> 8U);
  const double half_tangent = 2 * fraction(second) - 1;  // of the angle of the long axis
  stone.cosine = (1 - half_tangent * half_tangent) / (1 + half_tangent * half_tangent);
  stone.sine = 2 * half_tangent / (1 + half_tangent * half_tangent);
  stone.tone = 0.6 + 0.7 * fraction(third >> 8U);
  return stone;
}

std::optional<SyntheticTerrain::Stone> SyntheticTerrain::stone_at(double x, double y) const {
  if (stone_cell_m_ <= 0) return std::nullopt;
  auto stone = stone_of_cell(std::floor(x / stone_cell_m_), std::floor(y / stone_cell_m_));
  return stone && stone->around(x, y) ? stone : std::nullopt;
}

// Distance along a ray to the next place that may have a stone: the rim of this cell's stone or the border of the cell.
double SyntheticTerrain::free_of_stones(double x, double y, double dx, double dy) const {
  constexpr double kInside = 1e-6;  // past the border, so that the next query is in the next cell
  const double cell_x = std::floor(x / stone_cell_m_), cell_y = std::floor(y / stone_cell_m_);
  const auto to_border = [&](double position, double cell, double speed) {
    if (speed == 0) return std::numeric_limits<double>::infinity();
    return ((cell + (speed > 0 ? 1 : 0)) * stone_cell_m_ - position) / speed;
  };
  double free = std::min(to_border(x, cell_x, dx), to_border(y, cell_y, dy));
  if (const auto stone = stone_of_cell(cell_x, cell_y)) {
    const double rx = x - stone->x, ry = y - stone->y;
    const double a = dx * dx + dy * dy, b = rx * dx + ry * dy;
    const double root = b * b - a * (rx * rx + ry * ry - stone->half_long * stone->half_long);
    if (root > 0 && b < 0) free = std::min(free, (-b - std::sqrt(root)) / a);
  }
  return std::max(free, 0.0) + kInside;
}

double SyntheticTerrain::relief(double x, double y) const {
  double height = 0;
  for (const Octave& octave : relief_) height += octave.value(x, y);
  return height;
}

NoiseSample SyntheticTerrain::ground(double x, double y) const {
  NoiseSample sum;
  for (const Octave& octave : relief_) add(sum, octave(x, y));
  if (const auto stone = stone_at(x, y)) add(sum, stone->surface(x, y));
  return sum;
}

double SyntheticTerrain::albedo(double x, double y, double footprint_m) const {
  double logarithm = 0;
  for (const Octave& octave : texture_) {
    // An octave fades in from one footprint per lattice step (wavelength 1.5 px, above the Nyquist limit) to two.
    const double weight = std::clamp(octave.size / footprint_m - 1, 0.0, 1.0);
    if (weight > 0) logarithm += weight * octave.value(x, y);
  }
  double tone = 1;
  if (const auto stone = stone_at(x, y)) {
    const double inside = std::clamp(1.6 * (1 - stone->rim(x, y).value), 0.0, 1.0);
    tone += inside * (stone->tone - 1);
  }
  return tone * std::exp(logarithm);
}

// Sphere tracing of a cone: at distance t its rays are up to t · spread from its axis.
double SyntheticTerrain::clear_distance(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                        double spread) const {
  constexpr double kFarEnough_m = 50, kSmallStep = 0.02;
  const double widening = spread * (1 + steepest_);
  const double fastest =
      std::max(-direction.z() + std::hypot(direction.x(), direction.y()) * steepest_ + widening, 1e-3);
  for (double t = 0; t < kFarEnough_m;) {
    const Eigen::Vector3d p = origin + t * direction;
    const double gap = p.z() - relief(p.x(), p.y()) - stone_top_ - t * widening;
    if (gap < kSmallStep * fastest) return t;
    t += gap / fastest;
  }
  return kFarEnough_m;
}

// Ray marching with steps that cannot pass through the ground. With the gap g to the ground, its derivative g' along
// the ray, and bounds L of the slope and K of the curvature of the hills, g stays positive for g / L (Hart, "Sphere
// tracing", 1996) and up to the root of g + g' t − K t²/2. Over a stone the first bound holds with the slope of the
// stone; elsewhere a step ends where the next stone may begin. Newton's method refines the intersection, from either
// side.
std::optional<double> SyntheticTerrain::intersect(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                                  double farthest, double nearest) const {
  constexpr double kExact = 1e-9, kNewton_m = 2e-3;
  const double top = relief_top_ + stone_top_;
  double t = nearest;
  if (origin.z() > top) {
    if (direction.z() >= 0) return std::nullopt;
    t = std::max(t, (origin.z() - top) / -direction.z());
  }
  const double across = std::hypot(direction.x(), direction.y());
  const double fastest = std::max(-direction.z() + across * steepest_, 1e-3);
  const double curvature = std::max(across * across * most_curved_, 1e-9);
  while (t < farthest) {
    const Eigen::Vector3d p = origin + t * direction;
    if (p.z() > top && direction.z() >= 0) return std::nullopt;
    NoiseSample surface;
    for (const Octave& octave : relief_) add(surface, octave(p.x(), p.y()));
    const bool low = stone_top_ > 0 && p.z() - surface.value < stone_top_;
    const auto stone = low ? stone_at(p.x(), p.y()) : std::nullopt;
    if (stone) add(surface, stone->surface(p.x(), p.y()));

    const double gap = p.z() - surface.value;
    const double rate = direction.z() - surface.dx * direction.x() - surface.dy * direction.y();
    if (std::abs(gap) < kExact) return t;
    if (rate < 0 && std::abs(gap) < -rate * kNewton_m) {
      t += gap / -rate;
      continue;
    }
    if (gap < 0) return t;  // the ray starts inside the ground
    if (stone) {
      t += gap / (fastest + across * kStoneSlope);
      continue;
    }
    const auto safe = [&](double g) {
      return std::max(g / fastest, (rate + std::sqrt(rate * rate + 2 * curvature * g)) / curvature);
    };
    if (stone_top_ <= 0) {
      t += safe(gap);
    } else if (low) {
      t += std::min(safe(gap), free_of_stones(p.x(), p.y(), direction.x(), direction.y()));
    } else {
      t += std::max(safe(gap - stone_top_), std::min(safe(gap), kNewton_m));
    }
  }
  return std::nullopt;
}

}  // namespace spartan::testing
