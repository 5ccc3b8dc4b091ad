// A landmark and its measurement in the current frame.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "spartan/core/pose.h"
#include "spartan/odometry/internal/motion/anchored_point.h"

namespace spartan::internal {

/// The cameras in whose current images a landmark was located.
enum class MeasuredIn : std::uint8_t { both, left, right };

struct LandmarkMatch {
  std::size_t landmark = 0;  ///< index of the landmark, for the caller
  bool established = false;  ///< was an inlier in several frames, so it is on no object that has just begun to move
  AnchoredPoint point;       ///< the landmark in its anchor
  double disparity_variance = 0;  ///< of the disparity in the anchor, pixels²
  Pose previous_from_anchor;
  Eigen::Vector3d measured;    ///< (u, v, d) in the current frame, pixels; predicted where it was not measured
  Eigen::Matrix3d covariance;  ///< of `measured`, pixels²; large in the direction that was not measured
  double parallax_px = 0;      ///< by how much the translation since the anchor has moved it in the left image
  MeasuredIn cameras = MeasuredIn::both;

  int dimensions() const { return cameras == MeasuredIn::both ? 3 : 2; }
  /// Sets a measurement in both images, whose position and disparity are independent.
  void set_measured(const Eigen::Vector2d& left_px, const Eigen::Matrix2d& covariance_px2, double disparity_px,
                    double disparity_sigma_px);
  /// Sets a measurement in the left or the right image alone, of which the disparity is known only as predicted.
  void set_measured_in_one(MeasuredIn camera, const Eigen::Vector2d& position_px, const Eigen::Matrix2d& covariance_px2,
                           double predicted_disparity_px);
  /// A difference of (u, v, d) without the direction that was not measured.
  Eigen::Vector3d observed(const Eigen::Vector3d& difference) const;
};

}  // namespace spartan::internal
