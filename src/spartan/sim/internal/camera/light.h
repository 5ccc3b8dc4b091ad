// The sun as a light source.
#pragma once

#include <Eigen/Core>
#include <array>

#include "spartan/sim/scenario_options.h"

namespace spartan::sim::internal {

/// The sun's disc, sampled at kPoints points. Ray s of a pixel is lit by point s, the same for both cameras and every
/// frame, so that soft shadows agree between images.
class Sun {
 public:
  explicit Sun(const LightOptions& options);
  static constexpr int kPoints = 4;
  /// Unit vector from the ground towards a point of the disc.
  const Eigen::Vector3f& direction(int sample) const { return points_[static_cast<std::size_t>(sample % kPoints)]; }
  /// Illuminance on a plane normal to the sun.
  double lux() const { return lux_; }
  /// Illuminance of open horizontal ground by sun and sky.
  double horizontal_lux(double sky_lux) const;

 private:
  std::array<Eigen::Vector3f, kPoints> points_;
  double lux_;
};

}  // namespace spartan::sim::internal
