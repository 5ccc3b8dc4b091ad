// The tracks that wheels leave in the soil.
#pragma once

#include <vector>

#include "spartan/core/image.h"
#include "spartan/sim/internal/world/region.h"
#include "spartan/sim/scenario.h"
#include "spartan/sim/scenario_options.h"

namespace spartan::sim::internal {

/// Depth of the tracks of a drive up to a time, rasterized over a region: two grooves with the prints of cleats.
class WheelTracks {
 public:
  static constexpr double kCell_m = 0.005;

  WheelTracks() = default;
  WheelTracks(const Drive& drive, double until_s, const ChassisOptions& chassis, const Region& region);

  /// Depth below the undisturbed soil in metres; 0 beside the tracks and outside the region.
  double depth(double x, double y) const;
  bool none() const { return depth_.width() == 0; }

 private:
  void press(const PlanarPose& at, double driven_m, const ChassisOptions& chassis);

  Region region_;
  Image<float> depth_;
};

}  // namespace spartan::sim::internal
