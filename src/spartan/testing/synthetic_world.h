// A small stereo world with known answers: textured ground, looked at by a rectified pair.
#pragma once

#include <cstdint>

#include "spartan/core/image.h"
#include "spartan/core/pose.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan::testing {

/// A height field z(x, y) over the world plane with a texture fixed to it; both are sums of smooth noise, so that
/// exact intersections and sub-pixel truth exist.
struct SyntheticWorldOptions {
  std::uint64_t seed = 1;
  double relief_m = 0.05;         ///< standard deviation of the height
  double relief_size_m = 1.0;     ///< wavelength of the largest hills
  double texture_size_m = 0.004;  ///< finest grain of the texture
  double contrast = 0.25;         ///< standard deviation of the albedo over its mean
  double noise_levels = 1.0;      ///< standard deviation of the image noise, gray levels
};

/// Two images and what is true about them.
struct SyntheticShot {
  Image<std::uint8_t> left, right;
  Image<float> disparity;    ///< of the left image; NaN where the ray meets nothing
  Image<std::uint8_t> mask;  ///< 255 seen by both eyes, 128 by the left one only, 0 nothing there
};

class SyntheticWorld {
 public:
  explicit SyntheticWorld(const SyntheticWorldOptions& options);

  /// Height of the ground, metres.
  double height(double x, double y) const;
  /// `world_from_left`: left optical frame (x right, y down, z forward) in the world (z up). `noise_seed` changes the
  /// image noise only.
  SyntheticShot render(const RectifiedStereo& stereo, const Pose& world_from_left, std::uint64_t noise_seed) const;

 private:
  SyntheticWorldOptions options_;
};

}  // namespace spartan::testing
