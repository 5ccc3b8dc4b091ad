#include "spartan/sim/internal/world/rock_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "spartan/numerics/gradient_noise.h"
#include "spartan/numerics/random.h"

namespace spartan::sim::internal {
namespace {

constexpr int kSteps = 400;                              // of numerical integration over diameters
constexpr double kCell_m = 2;                            // rocks are drawn per square cell of this side
constexpr std::array<double, 2> kBorders_m{0.04, 0.15};  // diameters that separate the strata
constexpr double kSmallestPebble_m = 0.004;
constexpr double kMaxElongation = 1.6;  // length over width
constexpr double kBuriedHeight = 0.4;   // height of buried rocks over that of others
constexpr int kFewestLayers = 3;
constexpr std::uint32_t kLayerChoices = 5;  // from kFewestLayers on

double density(double coverage, double q, double diameter) {
  return coverage * q * std::exp(-q * diameter) * 4 / (std::numbers::pi * diameter * diameter);
}

double diameter_of_step(double from_m, double to_m, double step) {
  return from_m * std::pow(to_m / from_m, step / kSteps);
}

// Knuth's algorithm for small means, the normal approximation for large ones.
int poisson(double mean, Random& random) {
  if (mean > 60) return std::max(0, static_cast<int>(std::lround(random.normal(mean, std::sqrt(mean)))));
  const double limit = std::exp(-mean);
  int count = 0;
  for (double product = random.uniform(); product > limit; product *= random.uniform()) ++count;
  return count;
}

}  // namespace

double golombek_q(double coverage) {
  return 1.79 + 0.152 / coverage;
}

double golombek_cover(double coverage, double diameter_m) {
  return coverage <= 0 ? 0 : coverage * std::exp(-golombek_q(coverage) * diameter_m);
}

double golombek_count_per_m2(double coverage, double from_m, double to_m) {
  if (coverage <= 0 || !(to_m > from_m)) return 0;
  // Simpson's rule over ln D, where the integrand is smooth.
  const double q = golombek_q(coverage), step = std::log(to_m / from_m) / kSteps;
  double sum = 0;
  for (int i = 0; i <= kSteps; ++i) {
    const double d = from_m * std::exp(i * step);
    sum += (i == 0 || i == kSteps ? 1 : i % 2 == 1 ? 4 : 2) * density(coverage, q, d) * d;
  }
  return sum * step / 3;
}

RockField::RockField(const RockFieldOptions& options, std::uint64_t seed) : options_(options), seed_(seed) {
  if (options.coverage > 0) {
    double from = options.smallest_m;
    std::uint64_t stream = 77;
    for (const double border : kBorders_m) {
      add_stratum(from, std::min(border, options.largest_m), stream++);
      from = std::max(from, border);
    }
    add_stratum(from, options.largest_m, stream);
  }
  if (options.pebbles_per_m2 > 0) {
    // Cumulative numbers fall with the square of the diameter, a power law of fragmentation.
    Stratum pebbles{kSmallestPebble_m, kLargestPebble_m, options.pebbles_per_m2, {0.0}, 90};
    const auto below = [](double d) { return 1 - kSmallestPebble_m * kSmallestPebble_m / (d * d); };
    for (int i = 1; i <= kSteps; ++i) {
      const double d = diameter_of_step(kSmallestPebble_m, kLargestPebble_m, i);
      pebbles.cumulative.push_back(options.pebbles_per_m2 * below(d) / below(kLargestPebble_m));
    }
    strata_.push_back(std::move(pebbles));
  }
}

void RockField::add_stratum(double from_m, double to_m, std::uint64_t stream) {
  if (!(to_m > from_m)) return;
  Stratum stratum{from_m, to_m, 0, {0.0}, stream};
  for (int i = 0; i < kSteps; ++i) {
    const double a = diameter_of_step(from_m, to_m, i), b = diameter_of_step(from_m, to_m, i + 1);
    stratum.cumulative.push_back(stratum.cumulative.back() + golombek_count_per_m2(options_.coverage, a, b));
  }
  stratum.count_per_m2 = stratum.cumulative.back();
  strata_.push_back(std::move(stratum));
}

void RockField::clear_corridor(DriveCorridor corridor, double clearance_m) {
  corridors_.push_back({std::move(corridor), clearance_m});
}

double RockField::Stratum::diameter_at(double count_fraction) const {
  const double wanted = count_fraction * count_per_m2;
  const auto above = std::upper_bound(cumulative.begin(), cumulative.end(), wanted);
  const auto i = std::clamp<std::ptrdiff_t>(above - cumulative.begin(), 1, kSteps) - 1;
  const auto at = static_cast<std::size_t>(i);
  const double part = (wanted - cumulative[at]) / (cumulative[at + 1] - cumulative[at]);
  return diameter_of_step(from_m, to_m, static_cast<double>(i) + std::clamp(part, 0.0, 1.0));
}

// Lowers the rock by the depth d of the dust at its place, where a half ellipsoid of height h has a section of
// diameter D √(1 − (d/h)²). Returns whether it stands out.
bool RockField::lower_into_dust(Rock& rock) const {
  if (cover_.none()) return true;
  const double depth_m = cover_.dust_depth(rock.x, rock.y);
  if (rock.height_m <= depth_m) return false;
  const double covered = depth_m / rock.height_m;
  rock.diameter_m *= std::sqrt(1 - covered * covered);
  rock.height_m -= depth_m;
  return true;
}

bool RockField::is_in_corridor(const Rock& rock) const {
  const double reach_m = 0.5 * rock.diameter_m * std::sqrt(kMaxElongation) * 1.1;
  const auto blocks = [&](const ClearedCorridor& c) {
    return rock.height_m > c.clearance_m && c.corridor.intersects_disc(rock.x, rock.y, reach_m);
  };
  return std::any_of(corridors_.begin(), corridors_.end(), blocks);
}

void RockField::append_cell(const Stratum& stratum, std::int32_t i, std::int32_t j, std::vector<Rock>& rocks) const {
  Random random(
      seed_ ^ (static_cast<std::uint64_t>(hash_coordinates(i, j, 0x524F434BU)) << 32U | hash_coordinates(j, i, 0x53U)),
      stratum.stream);
  const int count = poisson(stratum.count_per_m2 * kCell_m * kCell_m, random);
  for (int k = 0; k < count; ++k) {
    Rock rock;
    rock.x = (i + random.uniform()) * kCell_m;
    rock.y = (j + random.uniform()) * kCell_m;
    rock.diameter_m = stratum.diameter_at(random.uniform());
    rock.height_m = rock.diameter_m * options_.height_ratio * random.uniform(0.6, 1.4);
    rock.turn_rad = random.uniform(0, 2 * std::numbers::pi);
    rock.elongation = random.uniform(1, kMaxElongation);
    rock.shape = random.next();
    // Drawn from the seed of the shape, so that these fractions change no other rock.
    if (hash_fraction(1, 0, rock.shape) < options_.buried_fraction) {
      rock.buried = true;
      rock.height_m *= kBuriedHeight;
    }
    if (hash_fraction(2, 0, rock.shape) < options_.layered_fraction)
      rock.layers = kFewestLayers + static_cast<int>(hash_coordinates(3, 0, rock.shape) % kLayerChoices);
    rocks.push_back(rock);
  }
}

std::vector<Rock> RockField::rocks_in(const Region& region, double smallest_m) const {
  const auto cell = [](double v) { return static_cast<std::int32_t>(std::floor(v / kCell_m)); };
  std::vector<Rock> found, here;
  for (const Stratum& stratum : strata_) {
    if (stratum.to_m <= smallest_m) continue;
    for (std::int32_t j = cell(region.y0); j <= cell(region.y1); ++j) {
      for (std::int32_t i = cell(region.x0); i <= cell(region.x1); ++i) {
        here.clear();
        append_cell(stratum, i, j, here);
        for (Rock& rock : here) {
          const bool inside = rock.x >= region.x0 && rock.x < region.x1 && rock.y >= region.y0 && rock.y < region.y1;
          if (inside && lower_into_dust(rock) && !is_in_corridor(rock)) found.push_back(rock);
        }
      }
    }
  }
  return found;
}

}  // namespace spartan::sim::internal
