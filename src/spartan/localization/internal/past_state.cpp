#include "spartan/localization/internal/past_state.h"

#include <Eigen/Cholesky>

namespace spartan::internal {

void begin_past(StateEstimate& estimate) {
  estimate.past.emplace();
  estimate.past->covariance = estimate.past->with_present = estimate.covariance;
}

// With r = H δ + v, E[v vᵀ] = R, E[δ vᵀ] = C and E[δ_p vᵀ] = C_p, present δ' = (I − K H) δ − K v and past
// δ_p' = δ_p − K_p r:
//   E[r δ'ᵀ] = (H P + Cᵀ) (I − K H)ᵀ − (H C + R) Kᵀ
//   E[δ_p' δ'ᵀ] = X (I − K H)ᵀ − C_p Kᵀ − K_p E[r δ'ᵀ]
//   E[δ_p' δ_p'ᵀ] = P_p − K_p (X Hᵀ + C_p)ᵀ − (X Hᵀ + C_p) K_pᵀ + K_p S K_pᵀ
// What the noise shares with errors of the state it shares through the error ξ of the present pose, as map_innovation()
// has it for the other errors of the present: C_p = X_ξ P_ξξ⁻¹ C_ξ.
void correct_past(PastState& past, const PresentUpdate& u) {
  using Columns = Eigen::Matrix<double, error_at::kSize, Eigen::Dynamic, 0, error_at::kSize, 6>;
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, error_at::kSize, 0, 6, error_at::kSize>;
  using RowsSquare = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;
  const Innovation& i = u.innovation;
  Rows residual_with_error = i.jacobian * u.covariance;  // E[r δᵀ]
  RowsSquare residual_with_noise = i.noise;              // E[r vᵀ]
  if (i.shared.cols() > 0) {
    residual_with_error += i.shared.transpose();
    residual_with_noise += i.jacobian * i.shared;
  }
  RowsSquare s = residual_with_error * i.jacobian.transpose() + residual_with_noise;
  s = (0.5 * (s + s.transpose())).eval();
  Columns past_with_noise = Columns::Zero(error_at::kSize, i.rows());
  if (i.shared.cols() > 0) {
    const Matrix6d pose = u.covariance.block<6, 6>(error_at::kPose, error_at::kPose);
    past_with_noise =
        past.with_present.middleCols<6>(error_at::kPose) * pose.ldlt().solve(i.shared.middleRows<6>(error_at::kPose));
  }
  const Columns past_with_residual = past.with_present * i.jacobian.transpose() + past_with_noise;
  Columns gain = s.llt().solve(past_with_residual.transpose()).transpose();
  if (!gain.allFinite()) return;
  for (int row = 0; row < error_at::kSize; ++row) {
    if (u.gain.row(row).isZero(0)) gain.row(row).setZero();
  }
  past.mean += gain * i.residual;
  const ErrorCovariance both = gain * past_with_residual.transpose();
  past.covariance += gain * s * gain.transpose() - both - both.transpose();
  past.with_present = (past.with_present * u.keep.transpose() - past_with_noise * u.gain.transpose()).eval();
  const Rows with_updated = residual_with_error * u.keep.transpose() - residual_with_noise * u.gain.transpose();
  past.with_present -= gain * with_updated;
}

}  // namespace spartan::internal
