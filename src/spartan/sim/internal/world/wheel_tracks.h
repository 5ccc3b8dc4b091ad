// The tracks that wheels leave in the soil.
#pragma once

#include <span>

#include "spartan/core/image.h"
#include "spartan/sim/internal/drive/driven_poses.h"
#include "spartan/sim/internal/world/region.h"
#include "spartan/sim/scenario_options.h"

namespace spartan::sim::internal {

/// Depth of the tracks of a drive up to a time, rasterized over a region: two grooves with the prints of cleats.
class WheelTracks {
 public:
  static constexpr double kCell_m = 0.005;
  static constexpr double kStep_m = 0.5 * kCell_m;  ///< between the poses that leave no gap

  WheelTracks() = default;
  WheelTracks(std::span<const DrivenPose> poses, double until_s, const ChassisOptions& chassis, const Region& region);

  /// Depth below the undisturbed soil in metres; 0 beside the tracks and outside the region.
  double depth(double x, double y) const;
  bool none() const { return depth_.width() == 0; }

 private:
  void press(const DrivenPose& driven, const ChassisOptions& chassis);

  Region region_;
  Image<float> depth_;
};

}  // namespace spartan::sim::internal
