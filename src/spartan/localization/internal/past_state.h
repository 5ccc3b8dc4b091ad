// The state at an earlier time beside the present one: the joint distribution that a fixed-interval smoother needs.
//
// With the cross-covariance X = E[past error · present errorᵀ], whatever changes the present error linearly, δ' = A δ +
// noise, changes X to X Aᵀ, and a measurement of the present corrects the past with the gain X Hᵀ S⁻¹. All functions
// that change a StateEstimate do so to its `past`, if it has one.
#pragma once

#include "spartan/localization/internal/error_state.h"
#include "spartan/localization/internal/kalman_update.h"

namespace spartan::internal {

/// The present becomes the past.
void begin_past(StateEstimate& estimate);

/// The part of the past in an update of the present by the gain K, which was optimal or not: `keep` = I − K H, before
/// the covariance of the present changes. Errors that K leaves alone are left alone in the past, too.
struct PresentUpdate {
  const Innovation& innovation;
  const ErrorCovariance& covariance;  ///< of the present error before the update
  const Eigen::Matrix<double, error_at::kSize, Eigen::Dynamic, 0, error_at::kSize, 6>& gain;
  const ErrorCovariance& keep;
};
void correct_past(PastState& past, const PresentUpdate& update);

}  // namespace spartan::internal
