// v-disparity: the ground profile of a disparity image, and the class of every pixel relative to it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/options.h"
#include "spartan/core/threads.h"
#include "spartan/reconstruction/local_map.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan {

/// Points p of the left optical frame with up · p = −height_m. Their disparities are linear in the image coordinates,
///   d = g · (u − c) + d_c  with  g = −(b/h) (up_x, up_y),  d_c = −(f b/h) up_z.
struct GroundPlane {
  Eigen::Vector3d up = -Eigen::Vector3d::UnitY();  ///< Unit normal that points away from the ground.
  double height_m = 1;                             ///< Height of the left camera above the plane.

  double disparity(const RectifiedStereo& g, double u, double v) const {
    const double x = (u - g.centre_px.x()) / g.focal_px, y = (v - g.centre_px.y()) / g.focal_px;
    return -g.focal_px * g.baseline_m / height_m * (up.x() * x + up.y() * y + up.z());
  }
  /// Angle of the optical axis below the plane's horizon, rad.
  double pitch_rad() const;
  /// Rotation of the image about the optical axis, rad; positive where the right side of the image is lower.
  double roll_rad() const;
};

struct GroundPlaneOptions {
  int block_px = 16;                ///< Side of an image block whose disparity gradient is fitted, pixels.
  double disparity_sigma_px = 0.3;  ///< Standard deviation of a disparity, pixels.
  double max_tilt_deg = 35;         ///< Largest angle between a block's plane and the expected plane, degrees.

  template <class Visitor>
  void describe(Visitor& v) {
    v.field(
        "block_px", block_px,
        "Side of the square image blocks to which planes are fitted, in pixels; raising it makes the gradients less "
        "noisy, but fewer blocks lie on the ground alone.",
        between(4, 128));
    v.former("disparity_sigma_px", disparity_sigma_px, GroundPlaneOptions().disparity_sigma_px,
             "mapping.disparity_sigma_px", between(0.01, 5));
    v.renamed("steepest_deg", "max_tilt_deg");
    v.field("max_tilt_deg", max_tilt_deg,
            "Largest angle between the plane of a block and the expected ground plane, in degrees; blocks that are "
            "tilted more are not used, so raise it for rough ground or an uncertain attitude.",
            between(1, 80));
  }
};

/// Estimates the ground plane, which is the ground correlation line of the v-disparity image (Labayrade, Aubert &
/// Tarel, IV 2002), without a Hough transform: a plane is fitted to each block of the disparity image; all blocks of
/// one plane in space have the same gradient, and the ground is the plane on which most blocks agree in gradient, then
/// in height. `expected` bounds the search; it is the plane that the rig and its attitude predict, and its height gives
/// the scale only. Returns nothing where fewer than a twentieth of the blocks agree.
std::optional<GroundPlane> find_ground_plane(ImageView<const float> disparity, const RectifiedStereo& geometry,
                                             const GroundPlane& expected, const GroundPlaneOptions& options);

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
    v.former("obstacle_m", obstacle_m, VDisparityOptions().obstacle_m, "mapping.map.obstacle_m", between(0.004, 5));
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
/// (1 − d₀/d) above the plane, h the height of the camera. `sigma`: standard deviations of the disparities in pixels,
/// of the same size; empty: options.plane.disparity_sigma_px. Derivation: docs/math/stereo.md.
std::optional<VDisparity> compute_v_disparity(ImageView<const float> disparity, const RectifiedStereo& geometry,
                                              const GroundPlane& expected, const VDisparityOptions& options,
                                              const ThreadPool& workers, ImageView<const float> sigma = {});

}  // namespace spartan
