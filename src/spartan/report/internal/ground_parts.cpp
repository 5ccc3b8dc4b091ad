#include "spartan/report/internal/ground_parts.h"

#include <algorithm>

namespace spartan::internal {

std::vector<double> marks(double px_per_m, double to_m) {
  constexpr double kRoom_px = 110;
  double step = 1e-6;
  for (int i = 0; step * px_per_m < kRoom_px; ++i) step *= i % 3 == 1 ? 2.5 : 2;
  std::vector<double> places(static_cast<std::size_t>(std::max(0.0, to_m) / step) + 1);
  for (std::size_t i = 0; i < places.size(); ++i) places[i] = static_cast<double>(i) * step;
  return places;
}

Points closed(Points points) {
  if (!points.empty()) points.push_back(points.front());
  return points;
}

}  // namespace spartan::internal
