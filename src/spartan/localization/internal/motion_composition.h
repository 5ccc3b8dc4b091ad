// A pose that follows from the last frame and the visual motion since, without any prediction.
#pragma once

#include "spartan/localization/internal/error_state.h"
#include "spartan/localization/internal/measurement_models.h"

namespace spartan::internal {

/// Replaces the pose by C M Exp(d̂): that of the last frame, times the measured motion M, corrected by the estimate
/// d̂ = D ẑ + E η̂ of the errors that last. With M = M_true Exp(−d − n) its error is
///
///     ξ = Ad((M Exp(d̂))⁻¹) ξ_c + J_r(d̂) (D δz + E δη + n).
///
/// This is the update by the motion with a prior of infinite covariance for the motion since the clone, exactly,
/// however far a prediction would be off. What other errors had in common with the predicted motion is lost.
void compose_motion(StateEstimate& estimate, const Pose& measured, const Matrix6d& covariance,
                    const MotionErrors& errors);

/// Replaces the velocity by that of a motion of `seconds` that has just ended, with an uncorrelated error of variance
/// `variance` (m²/s²) along each axis. The velocity is constant in the body frame, as in the constant-velocity model.
void set_velocity(StateEstimate& estimate, const Pose& motion, double seconds, double variance);

}  // namespace spartan::internal
