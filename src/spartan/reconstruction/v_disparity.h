// v-disparity: the ground profile of a disparity image, and the class of every pixel relative to it.
#pragma once

#include <cstdint>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/options.h"
#include "spartan/core/threads.h"
#include "spartan/reconstruction/ground_class.h"
#include "spartan/reconstruction/ground_plane.h"

namespace spartan {

struct VDisparityOptions {
  int strips = 5;               ///< Number of vertical image strips, each with its own ground profile.
  double obstacle_m = 0.08;     ///< Minimum height of an obstacle above the ground profile, m.
  double cavity_m = 0.08;       ///< Minimum depth of a cavity below the ground profile, m.
  double tolerance_sigmas = 3;  ///< Standard deviations of the height that are added to both thresholds.
  double max_slope_deg = 30;    ///< Largest slope of the profile relative to the ground plane, degrees.
  GroundPlaneOptions plane;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("strips", strips,
            "Number of vertical strips of the image, each with its own ground profile (1: one profile for the whole "
            "image); raising it follows ground that is higher on one side, with fewer pixels per profile.",
            between(1, 32));
    v.field("obstacle_m", obstacle_m,
            "Minimum height of an obstacle pixel above the ground profile in metres; raising it marks fewer pixels as "
            "obstacles.",
            between(0.005, 5));
    v.field("cavity_m", cavity_m,
            "Minimum depth of a cavity (negative obstacle) pixel below the ground profile in metres; raising it marks "
            "fewer pixels as cavities.",
            between(0.005, 5));
    v.field("tolerance_sigmas", tolerance_sigmas,
            "Standard deviations of a pixel's height, from the disparity noise, that are added to both thresholds; "
            "raising it marks fewer far pixels.",
            between(0, 10));
    v.renamed("steepest_deg", "max_slope_deg");
    v.field("max_slope_deg", max_slope_deg,
            "Largest slope of the ground profile relative to the ground plane in degrees; raising it follows steeper "
            "terrain, but also large rocks.",
            between(1, 80));
    v.group("plane", plane);
  }
};

/// Height of the ground above its plane along one strip of the image, at knots of horizontal range from the camera that
/// grow by a constant ratio.
struct GroundProfile {
  static constexpr double kRatio = 1.04;  ///< Ratio of the ranges of consecutive knots; empirical.
  double nearest_m = 1;
  std::vector<double> height_m;  ///< Mean height for ranges from nearest_m · kRatio^i to nearest_m · kRatio^(i+1).
  double at(double range_m) const;
};

struct VDisparity {
  GroundPlane plane;
  std::vector<GroundProfile> profiles;  ///< Of the strips, from left to right.
  Image<std::uint16_t> histogram;       ///< v-disparity image. Row: derotated image row; column: disparity / bin_px.
  double bin_px = 1;
  double first_row_px = 0;      ///< Derotated image row of the histogram's first row, relative to the principal point.
  Image<std::uint8_t> classes;  ///< GroundClass of every pixel.
};

/// Ground profile and pixel classes of a disparity image; nothing where no ground plane is found. find_ground_plane()
/// estimates the ground correlation line of the v-disparity image (Labayrade, Aubert & Tarel, IV 2002). Relative to
/// that plane, the profile of the ground is the most populated path through a histogram of range and height whose slope
/// is bounded (dynamic programming). A pixel of disparity d whose ray meets the plane at disparity d₀ has the height h
/// (1 − d₀/d) above the plane, h the height of the camera. Derivation: docs/math/stereo.md.
std::optional<VDisparity> compute_v_disparity(ImageView<const float> disparity, const RectifiedStereo& geometry,
                                              const GroundPlane& expected, const VDisparityOptions& options,
                                              const ThreadPool& workers);

}  // namespace spartan
