// Positions and sizes of rocks.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "spartan/sim/internal/drive/drive_corridor.h"
#include "spartan/sim/internal/world/ground_cover.h"
#include "spartan/sim/internal/world/region.h"
#include "spartan/sim/scenario_options.h"

namespace spartan::sim::internal {

/// q(k) of Golombek & Rapp (JGR 1997); `coverage` is their k.
double golombek_q(double coverage);
/// F(D): fraction of the area covered by rocks of this diameter and more.
double golombek_cover(double coverage, double diameter_m);
/// Rocks per m² with diameters in [from_m, to_m]: ∫ −F'(D) / (π D²/4) dD.
double golombek_count_per_m2(double coverage, double from_m, double to_m);

struct Rock {
  double x = 0, y = 0;      ///< m, world
  double diameter_m = 0;    ///< of the circle with the area that the rock covers, seen from above
  double height_m = 0;      ///< above the ground
  double turn_rad = 0;      ///< rotation about the vertical
  double elongation = 1;    ///< length over width
  std::uint32_t shape = 0;  ///< seed of the shape
  bool buried = false;      ///< only its top shows
  int layers = 0;           ///< that stand out; 0: none
};

/// A random, infinite field of rocks. They are drawn in strata of size, so that distant views need not generate the
/// pebbles.
class RockField {
 public:
  RockField(const RockFieldOptions& options, std::uint64_t seed);
  static constexpr double kLargestPebble_m = 0.01;  ///< m; diameter of the pebbles besides the model

  /// Removes rocks higher than `clearance_m` that reach into the corridor. Of several calls each removes rocks.
  void clear_corridor(DriveCorridor corridor, double clearance_m);
  /// Lowers the rocks by the depth of the dust at their places, above which their sections are smaller; removes lower
  /// ones.
  void bury_under_dust(GroundCover cover) { cover_ = std::move(cover); }

  /// Rocks whose centre lies in the region; strata without rocks above `smallest_m` are skipped. A rock is the same
  /// whatever region is queried.
  std::vector<Rock> rocks_in(const Region& region, double smallest_m = 0) const;

 private:
  struct Stratum {
    double from_m = 0, to_m = 0;
    double count_per_m2 = 0;
    std::vector<double> cumulative;  ///< counts per m² from the smallest up to kSteps diameters
    std::uint64_t stream = 0;
    double diameter_at(double count_fraction) const;
  };
  void add_stratum(double from_m, double to_m, std::uint64_t stream);
  void append_cell(const Stratum& stratum, std::int32_t i, std::int32_t j, std::vector<Rock>& rocks) const;
  bool lower_into_dust(Rock& rock) const;
  bool is_in_corridor(const Rock& rock) const;

  RockFieldOptions options_;
  std::uint64_t seed_ = 0;
  std::vector<Stratum> strata_;
  struct ClearedCorridor {
    DriveCorridor corridor;
    double clearance_m;
  };
  std::vector<ClearedCorridor> corridors_;
  GroundCover cover_;
};

}  // namespace spartan::sim::internal
