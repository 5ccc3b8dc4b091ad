// Where rocks lie and how large they are.
#pragma once

#include <cstdint>
#include <vector>

#include "spartan/core/options.h"
#include "spartan/sim/clear_way.h"
#include "spartan/sim/region.h"

namespace spartan::sim {

/// Sizes follow Golombek & Rapp, "Size-frequency distributions of rocks on Mars" (JGR 1997): rocks of diameter D and
/// more cover the share F(D) = k exp(−q D) of the ground, q = 1.79 + 0.152/k, D in metres.
struct RockFieldOptions {
  double share = 0.07;
  double smallest_m = 0.01;
  double largest_m = 2.5;
  double height_ratio = 0.5;
  double pebbles_per_m2 = 300;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("share", share, "k: share of the area that rocks of all sizes cover", between(0, 0.3));
    v.field("smallest_m", smallest_m, "diameter of the smallest pebbles", between(0.003, 1));
    v.field("largest_m", largest_m, "diameter of the largest rocks", between(0.01, 5));
    v.field("pebbles_per_m2", pebbles_per_m2, "small ones beyond the model, 4 to 10 mm", between(0, 5000));
    v.field("height_ratio", height_ratio, "height over the ground / diameter, on average", between(0.1, 1));
  }
};

/// q(k) of the model.
double golombek_q(double share);
/// F(D): share of the area covered by rocks of this diameter and more.
double golombek_cover(double share, double diameter_m);
/// Rocks per m² with diameters in [from_m, to_m]: ∫ −F'(D) / (π D²/4) dD.
double golombek_count_per_m2(double share, double from_m, double to_m);

struct Rock {
  double x = 0, y = 0;      ///< m, world
  double diameter_m = 0;    ///< mean horizontal extent
  double height_m = 0;      ///< over the ground
  double turn_rad = 0;      ///< about the vertical
  double elongation = 1;    ///< length over width
  std::uint32_t shape = 0;  ///< which of the shapes, by chance
};

/// Rocks come in strata of size, so that who looks from afar need not make the pebbles.
class RockField {
 public:
  RockField(const RockFieldOptions& options, std::uint64_t seed);
  static constexpr double kLargestPebble_m = 0.01;  ///< of those beyond the model

  /// Rocks higher than this are left out where they would block the way.
  void keep_off(ClearWay way, double clearance_m);

  /// Those whose middle lies in the region; without the strata that hold nothing above `smallest_m`. The same whenever
  /// and for whatever region it is asked.
  std::vector<Rock> rocks_between(const Region& region, double smallest_m = 0) const;

 private:
  struct Stratum {
    double from_m = 0, to_m = 0;
    double count_per_m2 = 0;
    std::vector<double> cumulative;  ///< counts per m² from the smallest up to kSteps diameters
    std::uint64_t stream = 0;
    double diameter_at(double share_of_count) const;
  };
  void add_stratum(double from_m, double to_m, std::uint64_t stream);
  void append_cell(const Stratum& stratum, std::int32_t i, std::int32_t j, std::vector<Rock>& rocks) const;
  bool is_in_the_way(const Rock& rock) const;

  RockFieldOptions options_;
  std::uint64_t seed_ = 0;
  std::vector<Stratum> strata_;
  ClearWay way_;
  double clearance_m_ = 0;
};

}  // namespace spartan::sim
