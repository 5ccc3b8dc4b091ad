// The 2.5D cell of the global map: its current surface, and an alternative surface of contradicting observations.
#pragma once

#include <cstdint>

#include "spartan/reconstruction/ground_class.h"

namespace spartan {

/// A surface in a cell, fused from the observations of one or more stops. Elevations are relative to the submap's
/// anchor.
struct CellSurface {
  float elevation_m = 0;
  float variance_m2 = 0;  ///< Variance of elevation_m.
  float lowest_m = 0, highest_m = 0;
  float count = 0;              ///< Number of points; 0: not observed.
  float occupancy_logodds = 0;  ///< Log-odds of an obstacle or a cavity.
  std::int32_t stop = -1;       ///< The first stop that observed it.
  std::int16_t shape = 0;       ///< Observations as an obstacle minus observations as a cavity.
  std::uint16_t votes = 0;      ///< Number of observations of the class; 0: the class is unknown.

  bool observed() const { return count > 0; }
  void shift_elevation(float by_m) {
    elevation_m += by_m;
    lowest_m += by_m;
    highest_m += by_m;
  }
  friend bool operator==(const CellSurface&, const CellSurface&) = default;
};

struct MapCell {
  CellSurface surface;
  CellSurface alternative;  ///< Fused from observations that contradict the surface.

  /// Cells that were never observed, or only without a class, are unknown; free cells are ground.
  GroundClass kind() const;
  friend bool operator==(const MapCell&, const MapCell&) = default;
};

/// Parameters of the fusion of elevations; see GlobalMapOptions.
struct CellFusion {
  double gate_sigmas = 3;
  double relief_sigma_ratio = 0.15;  ///< Standard deviation of a cell's elevation over its relief.
  double least_variance_m2 = 4e-6;
};

/// Fuses one observation into a cell. If it passes the gate of the surface, both are fused with inverse-variance
/// weights (the variance has a lower bound), and the alternative loses a vote. Otherwise the surface does not change:
/// if the observation passes the gate of the alternative, it is fused into that; if not, the alternative loses a vote.
/// An alternative without votes is discarded. When its variance is at most that of the surface, the two are swapped. So
/// a variance never rises, and repeated contradiction replaces the surface.
MapCell fuse_observation(const MapCell& cell, const CellSurface& observation, const CellFusion& fusion);

}  // namespace spartan
