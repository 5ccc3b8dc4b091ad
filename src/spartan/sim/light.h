// Sun and sky over the ground, and how much of the sky each place sees.
#pragma once

#include <Eigen/Core>
#include <array>

#include "spartan/core/options.h"
#include "spartan/sim/ground_scene.h"

namespace spartan::sim {

/// Illuminances on a level plane in lux.
struct LightOptions {
  double sun_lux = 20000;
  double sun_elevation_deg = 45;
  double sun_azimuth_deg = 70;
  double sun_diameter_deg = 0.35;
  double sky_lux = 6000;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("sun_lux", sun_lux, "of the direct sun, on a plane turned to it", between(0, 200000));
    v.field("sun_elevation_deg", sun_elevation_deg, "over the horizon", between(1, 90));
    v.field("sun_azimuth_deg", sun_azimuth_deg, "where it stands, counter-clockwise from x");
    v.field("sun_diameter_deg", sun_diameter_deg, "makes shadows soft", between(0, 5));
    v.field("sky_lux", sky_lux, "of the whole sky on a level plane", between(0, 100000));
  }
};

/// Points on the sun's disc: sample s of a pixel looks at point s, the same for both eyes and every frame.
class Sun {
 public:
  explicit Sun(const LightOptions& options);
  static constexpr int kPoints = 4;
  const Eigen::Vector3f& towards(int sample) const { return points_[static_cast<std::size_t>(sample % kPoints)]; }
  double lux() const { return lux_; }
  /// Illuminance of level ground in the open, by sun and sky.
  double level_lux(double sky_lux) const;

 private:
  std::array<Eigen::Vector3f, kPoints> points_;
  double lux_;
};

}  // namespace spartan::sim
