// A rectangle in the world plane.
#pragma once

namespace spartan::sim::internal {

/// Bounds in metres.
struct Region {
  double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  bool contains(double x, double y) const { return x >= x0 && x <= x1 && y >= y0 && y <= y1; }
  Region grown(double by_m) const { return {x0 - by_m, y0 - by_m, x1 + by_m, y1 + by_m}; }
};

}  // namespace spartan::sim::internal
