#include "spartan/system/internal/map_description.h"

#include <algorithm>

namespace spartan::internal {

MapDescription map_description(const MapContext& about) {
  MapDescription description;
  if (about.x_is_east) {
    description.coordinate_system = *about.x_is_east ? "Spartan world frame: x east, y north, z up; metres"
                                                     : "Spartan world frame: x start heading, y left, z up; metres";
    description.items.emplace_back("X_AXIS", *about.x_is_east ? "east" : "start_heading");
  } else {
    description.coordinate_system = "Spartan map frame: z up; metres";
  }
  if (about.stops.empty()) return description;
  const auto earlier = [](const auto& a, const auto& b) { return a.second < b.second; };
  const auto [first, last] = std::minmax_element(about.stops.begin(), about.stops.end(), earlier);
  description.items.emplace_back("FIRST_STAMP_NS", std::to_string(first->second.ns));
  description.items.emplace_back("LAST_STAMP_NS", std::to_string(last->second.ns));
  description.items.emplace_back("STOPS", std::to_string(about.stops.size()));
  return description;
}

}  // namespace spartan::internal
