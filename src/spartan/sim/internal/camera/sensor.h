// From luminance to gray levels: lens, exposure, electrons, noise, quantization.
#pragma once

#include <cstdint>
#include <vector>

#include "spartan/core/frame_image.h"
#include "spartan/core/image.h"
#include "spartan/core/threads.h"
#include "spartan/rig/rig.h"
#include "spartan/sim/internal/camera/renderer.h"
#include "spartan/sim/sensor_options.h"

namespace spartan::sim::internal {

/// Exposure time and gain of one frame, the same for both cameras.
struct Exposure {
  double seconds = 0;
  double gain = 1;  ///< gray levels per electron: gain · (full scale − black) / full well
};

/// Electrons per second in a pixel on the optical axis for a luminance of 1 cd/m², light of 555 nm:
///   E = π T L / (4 N²) lux,  photons/s/m² = E / (683 lm/W · h c/λ),  times pixel area and quantum efficiency.
double electrons_per_second(const SensorOptions& sensor);

/// Auto exposure: brings the mean luminance to the target level by the exposure time up to its limit, then by the gain
/// up to its limit.
Exposure choose_exposure(const SensorOptions& sensor, double mean_luminance);

/// The vignetting of the lens as a rig states it: the polynomial that fits SensorOptions::vignetting best over the
/// image.
Vignetting fitted_vignetting(const Camera& camera, double vignetting);

/// Fault of one image.
struct ImageFault {
  double light_factor = 1;  ///< on all light; 0: dark
  bool dust = false;        ///< specks on the lens
  std::uint64_t dust_seed = 0;
};

/// What distinguishes one camera from others of its kind.
struct SensorIdentity {
  double gain = 1;                 ///< response to light over the nominal one
  std::uint64_t pattern_seed = 0;  ///< of its fixed pattern
};

/// The image sensor behind one camera's lens.
class Sensor {
 public:
  Sensor(const SensorOptions& options, const Camera& camera, const SensorIdentity& identity = {});

  /// The image in the camera's pixel format: signal, shot noise, read noise, row noise, fixed pattern, full well, gain,
  /// quantization, and the losses of compression. The noise depends on seed and pixel alone.
  FrameImage expose(const LuminanceImage& luminance, const Exposure& exposure, const ImageFault& fault,
                    std::uint64_t seed, const ThreadPool& workers) const;
  /// The same without noise and quantization: gray levels above black, for measurements.
  Image<float> noise_free(const LuminanceImage& luminance, const Exposure& exposure) const;

  double levels_per_electron(const Exposure& exposure) const;

 private:
  Image<float> electrons(const LuminanceImage& image, const Exposure& exposure, const ImageFault& fault) const;

  SensorOptions options_;
  Camera camera_;
  Image<float> response_;      // of each pixel: vignetting, fixed pattern, gain of the camera
  Image<float> dark_level_e_;  // of each pixel; empty: 0
};

}  // namespace spartan::sim::internal
