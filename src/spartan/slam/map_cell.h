// The 2.5D cell of the global map: what is believed of a piece of ground, and what speaks against it.
#pragma once

#include <cstdint>

namespace spartan {

/// A surface in a cell, as one or more stops saw it. Elevations are over the submap's anchor.
struct CellSurface {
  float elevation_m = 0;
  float variance_m2 = 0;  ///< of elevation_m
  float lowest_m = 0, highest_m = 0;
  float count = 0;              ///< points; 0: nothing was seen
  float occupancy_logodds = 0;  ///< of an obstacle or a cavity
  std::int32_t stop = -1;       ///< the first that saw it
  std::int16_t shape = 0;       ///< obstacles seen less cavities seen
  std::uint16_t votes = 0;      ///< observations of its class; 0: the class is unknown

  bool seen() const { return count > 0; }
  void raise(float by_m) {
    elevation_m += by_m;
    lowest_m += by_m;
    highest_m += by_m;
  }
  friend bool operator==(const CellSurface&, const CellSurface&) = default;
};

struct MapCell {
  CellSurface surface;
  CellSurface rival;  ///< of observations that contradict it

  /// 0 unknown, 1 free, 2 obstacle, 3 cavity. Unknown: never observed, or only without a class.
  int kind() const;
  friend bool operator==(const MapCell&, const MapCell&) = default;
};

/// When two elevations belong to one surface, and how well one can be known.
struct CellFusion {
  double gate_sigmas = 3;
  double relief_sigma = 0.15;  ///< what a cell's own relief adds to a difference, over that relief
  double least_variance_m2 = 4e-6;
};

/// The cell with one more observation. Within the gate the two fuse by their variances (never to less than the least).
/// Beyond it the surface stays as it is: the rival takes the observation where the two agree, else loses a vote and is
/// forgotten with its last one; it takes the surface's place as soon as it is known at least as well. What confirms the
/// surface costs the rival a vote too. So a variance never rises, and a repeated contradiction wins.
MapCell observed(const MapCell& cell, const CellSurface& observation, const CellFusion& fusion);

}  // namespace spartan
