// From luminance to gray levels: lens, exposure, electrons, noise, bits.
#pragma once

#include <cstdint>
#include <vector>

#include "spartan/core/frame_image.h"
#include "spartan/core/image.h"
#include "spartan/core/options.h"
#include "spartan/core/threads.h"
#include "spartan/rig/rig.h"
#include "spartan/sim/renderer.h"

namespace spartan::sim {

struct SensorOptions {
  double pixel_um = 5.5;
  double f_number = 2.0;
  double transmission = 0.9;
  double vignetting = 0.7;
  double quantum_efficiency = 0.5;
  double full_well_e = 15000;
  double read_noise_e = 15;
  double black_level = 1.0 / 64;
  double target_level = 0.45;
  double longest_exposure_ms = 20;
  double largest_gain = 16;
  int noise_seed = 0;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("pixel_um", pixel_um, "side of a pixel", between(0.5, 50));
    v.field("f_number", f_number, "focal length over aperture", between(0.7, 32));
    v.field("transmission", transmission, "of the lens", between(0.05, 1));
    v.field("vignetting", vignetting, "exponent over cos⁴ of the field angle: 0 none, 1 natural", between(0, 3));
    v.field("quantum_efficiency", quantum_efficiency, "electrons a photon", between(0.01, 1));
    v.field("full_well_e", full_well_e, "electrons", between(500, 200000));
    v.field("read_noise_e", read_noise_e, "standard deviation, electrons", between(0, 500));
    v.field("black_level", black_level, "level without light over full scale", between(0, 0.25));
    v.field("target_level", target_level, "mean signal that the exposure rule wants, over full scale",
            between(0.01, 0.9));
    v.field("longest_exposure_ms", longest_exposure_ms, "beyond it gain takes over", between(0.01, 10000));
    v.field("largest_gain", largest_gain, "1: the full well fills the range", between(1, 1000));
    v.field("noise_seed", noise_seed, "another one gives the same world other noise", at_least(0));
  }
};

/// Exposure time and gain of one shot, the same for both eyes.
struct Exposure {
  double seconds = 0;
  double gain = 1;  ///< gray levels an electron: gain · (full scale − black) / full well
};

/// Electrons a second in a pixel on the axis for a luminance of 1 cd/m², light of 555 nm:
///   E = π T L / (4 N²) lux,  photons/s/m² = E / (683 lm/W · h c/λ),  times pixel area and quantum efficiency.
double electrons_per_second(const SensorOptions& sensor);

/// Brings the mean luminance to the target level: the time first, up to the longest; then gain, up to the largest.
Exposure choose_exposure(const SensorOptions& sensor, double mean_luminance);

/// What goes wrong in one eye at one moment.
struct EyeFault {
  double light = 1;   ///< factor on all light: 0 dark
  bool dust = false;  ///< specks on the lens
  std::uint64_t dust_seed = 0;
};

class Sensor {
 public:
  Sensor(const SensorOptions& options, const Camera& camera);

  /// The image as the camera's pixel format has it: signal, shot and read noise, full well, gain, rounding.
  /// The noise depends on seed and pixel alone.
  FrameImage expose(const Radiance& radiance, const Exposure& exposure, const EyeFault& fault, std::uint64_t seed,
                    const Workers& workers) const;
  /// The same without noise and rounding: gray levels over black, for measurements.
  Image<float> noise_free(const Radiance& radiance, const Exposure& exposure) const;

  /// Gray levels an electron.
  double levels_per_electron(const Exposure& exposure) const;

 private:
  Image<float> electrons(const Radiance& radiance, const Exposure& exposure, const EyeFault& fault) const;

  SensorOptions options_;
  Camera camera_;
  Image<float> falloff_;  // of the lens
};

}  // namespace spartan::sim
