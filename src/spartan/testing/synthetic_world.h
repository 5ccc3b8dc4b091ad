// Renders stereo images of textured ground with ground truth for a rectified pair.
#pragma once

#include <cstdint>

#include "spartan/core/image.h"
#include "spartan/core/pose.h"
#include "spartan/rig/rectified_stereo.h"
#include "spartan/testing/synthetic_terrain.h"

namespace spartan::testing {

/// A stereo frame with its ground truth.
struct SyntheticFrame {
  Image<std::uint8_t> left, right;
  Image<float> disparity;    ///< px of the left image; NaN where the ray hits nothing
  Image<std::uint8_t> mask;  ///< 255 visible in both cameras, 128 in the left one only, 0 no truth
};

/// Renders the ground of SyntheticTerrain with sunlight, sky light and image noise.
class SyntheticWorld {
 public:
  explicit SyntheticWorld(const SyntheticWorldOptions& options);

  /// Height of the ground with stones, and of the hills alone, in metres.
  double height(double x, double y) const;
  double relief(double x, double y) const;
  /// `world_from_left`: left optical frame (x right, y down, z forward) in the world (z up). `noise_seed` changes the
  /// image noise only.
  SyntheticFrame render(const RectifiedStereo& stereo, const Pose& world_from_left, std::uint64_t noise_seed) const;

 private:
  struct View;
  struct Surface;
  Image<double> measure_depth(const View& view) const;
  bool visible_in_right(const View& right, ImageView<const double> right_depth, double u, int v, double depth) const;
  Image<std::uint8_t> render_image(const View& view, ImageView<const double> depth, std::uint64_t noise_seed) const;
  double gray_level(const View& view, int u, int v, double depth, bool at_edge) const;
  double shade(const View& view, const Surface& surface, double depth) const;

  SyntheticWorldOptions options_;
  SyntheticTerrain terrain_;
};

}  // namespace spartan::testing
