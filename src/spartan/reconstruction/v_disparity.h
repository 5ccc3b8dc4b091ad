// v-disparity: the ground as a profile over the rows, and every pixel above it, on it or below it.
#pragma once

#include <cstdint>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/options.h"
#include "spartan/core/threads.h"
#include "spartan/reconstruction/ground_plane.h"

namespace spartan {

/// What a pixel or a cell of the ground is.
enum class GroundClass : std::uint8_t { unknown, ground, obstacle, cavity };

struct VDisparityOptions {
  int strips = 5;
  double obstacle_m = 0.08;
  double cavity_m = 0.08;
  double tolerance_sigmas = 3;
  double steepest_deg = 30;
  GroundPlaneOptions plane;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("strips", strips, "side by side, each with a profile of its own; 1: one for the whole image",
            between(1, 32));
    v.field("obstacle_m", obstacle_m, "over the ground", between(0.005, 5));
    v.field("cavity_m", cavity_m, "below the ground", between(0.005, 5));
    v.field("tolerance_sigmas", tolerance_sigmas, "of the disparity's noise, added to both", between(0, 10));
    v.field("steepest_deg", steepest_deg, "of the profile against the plane", between(1, 80));
    v.group("plane", plane);
  }
};

/// How high the ground stands over its plane along one strip of the image, at knots of horizontal range from the eye
/// that grow by a constant ratio.
struct GroundProfile {
  static constexpr double kRatio = 1.04;
  double nearest_m = 1;
  std::vector<double> height_m;  ///< at nearest_m · kRatio^i
  double at(double range_m) const;
};

struct VDisparity {
  GroundPlane plane;
  std::vector<GroundProfile> profiles;  ///< of the strips, from left to right
  Image<std::uint16_t> histogram;       ///< row: derotated image row; column: disparity / bin_px
  double bin_px = 1;
  double first_row_px = 0;      ///< derotated row of the histogram's first, from the centre
  Image<std::uint8_t> classes;  ///< GroundClass of every pixel
};

/// None where there is no ground to be found. Method: find_ground_plane() gives the correlation line of the v-disparity
/// image by orientation; along it the profile of the real ground is the most populated path (dynamic programming) of
/// height over the plane against range that is nowhere steeper than allowed. A pixel of disparity d whose ray meets the
/// plane at disparity d₀ stands h (1 − d₀/d) over the plane, h the eye's height.
std::optional<VDisparity> compute_v_disparity(ImageView<const float> disparity, const RectifiedStereo& geometry,
                                              const GroundPlane& expected, const VDisparityOptions& options,
                                              const Workers& workers);

}  // namespace spartan
