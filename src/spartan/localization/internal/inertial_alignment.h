// Biases, velocity and the direction of gravity from visual motions and the IMU, without a rest.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "spartan/core/pose.h"
#include "spartan/localization/internal/preintegration.h"

namespace spartan::internal {

/// A visual motion of the body with what the IMU measured over the same interval.
struct AlignmentSegment {
  Pose motion;  ///< previous_from_current
  Matrix6d covariance = Matrix6d::Zero();
  Preintegration inertial;
};

/// Standard deviations of the biases and the clock before any measurement, the size of gravity, and what is known of
/// its direction.
struct AlignmentPrior {
  double gyro_bias_rad_s = 0, accel_bias_m_s2 = 0, gravity_m_s2 = 0;
  double time_s = 0;                  ///< of the clock of the IMU
  std::optional<Eigen::Vector3d> up;  ///< unit vector, in the body frame at the end of the last segment
  double up_sigma_rad = 0;
};

/// All in the body frame at the end of the last segment.
struct InertialAlignment {
  Eigen::Vector3d gyro_bias_rad_s, accel_bias_m_s2, velocity_m_s;
  Eigen::Vector3d up;        ///< unit vector opposite to gravity
  double time_offset_s = 0;  ///< stamps of the readings minus their times by the clock of the frames
  /// Of (gyro bias, accelerometer bias, velocity, up, time offset), with the variances of the motions and the IMU
  /// multiplied by `noise_factor`; along `up` it is zero.
  Eigen::Matrix<double, 13, 13> covariance;
  double noise_factor = 1;  ///< chi-square per degree of freedom, at least 1
};

/// Least squares over consecutive segments: unknown are the biases, the clock of the IMU, the direction of gravity and
/// the velocity at each frame. The residuals of a segment with the motion M = (D, d) and the IMU's ΔR, Δv, Δp
/// (preintegration.h) are
///
///     Log(ΔRᵀ D),   R_kᵀ (v_{k+1} − v_k + g up t) − Δv,   d − R_kᵀ (v_k t − ½ g up t²) − Δp.
///
/// With the scale known from stereo this is the visual-inertial alignment of Qin, Li & Shen, "VINS-Mono", TRO 2018,
/// section V, solved for all unknowns together. Nothing with fewer than three segments (one if `up` is given), where
/// the two sensors do not fit (chi-square per degree of freedom above 9), or with biases far outside of their prior.
std::optional<InertialAlignment> align_inertially(std::span<const AlignmentSegment> segments,
                                                  const AlignmentPrior& prior);

}  // namespace spartan::internal
