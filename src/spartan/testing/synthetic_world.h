// A small stereo world with known answers: textured ground, looked at by a rectified pair.
#pragma once

#include <cstdint>

#include "spartan/core/image.h"
#include "spartan/core/pose.h"
#include "spartan/rig/rectified_stereo.h"
#include "spartan/testing/synthetic_terrain.h"

namespace spartan::testing {

/// Two images and what is true about them.
struct SyntheticShot {
  Image<std::uint8_t> left, right;
  Image<float> disparity;    ///< of the left image; NaN where the ray meets nothing
  Image<std::uint8_t> mask;  ///< 255 seen by both eyes, 128 by the left one only, 0 nothing there
};

class SyntheticWorld {
 public:
  explicit SyntheticWorld(const SyntheticWorldOptions& options);

  /// Height of the ground with its stones, and of the hills alone (where a rover would drive), metres.
  double height(double x, double y) const;
  double relief(double x, double y) const;
  /// `world_from_left`: left optical frame (x right, y down, z forward) in the world (z up). `noise_seed` changes the
  /// image noise only.
  SyntheticShot render(const RectifiedStereo& stereo, const Pose& world_from_left, std::uint64_t noise_seed) const;

 private:
  struct Eye;
  struct Surface;
  Image<double> measure_depth(const Eye& eye) const;
  bool right_eye_sees(const Eye& right, ImageView<const double> right_depth, double u, int v, double depth) const;
  Image<std::uint8_t> photograph(const Eye& eye, ImageView<const double> depth, std::uint64_t noise_seed) const;
  double gray_level(const Eye& eye, int u, int v, double depth, bool at_edge) const;
  double reflected(const Eye& eye, const Surface& surface, double depth) const;

  SyntheticWorldOptions options_;
  SyntheticTerrain terrain_;
};

}  // namespace spartan::testing
