// How far wheels are lifted by the rocks that they roll over.
#pragma once

#include <vector>

#include "spartan/sim/internal/world/rock_field.h"
#include "spartan/sim/internal/world/spatial_hash.h"

namespace spartan::sim::internal {

/// A rigid wheel over rocks approximated by half ellipsoids of their size. Rocks lower than kPressedIn_m are pressed
/// into the soil.
class WheelLift {
 public:
  static constexpr double kPressedIn_m = 0.01;

  WheelLift() = default;
  WheelLift(const std::vector<Rock>& rocks, double wheel_radius_m, double wheel_width_m);

  /// Lift of a wheel on level ground in metres: the maximum, over its footprint, of the height of the rocks less that
  /// of the wheel's rim above the ground, R − √(R² − s²) at the distance s before or behind its centre.
  double at(double x, double y, double heading) const;

 private:
  double rocks_over(double x, double y) const;

  double radius_m_ = 0, width_m_ = 0, largest_reach_m_ = 0;
  SpatialHash<Rock> rocks_;
};

}  // namespace spartan::sim::internal
