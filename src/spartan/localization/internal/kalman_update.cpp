#include "spartan/localization/internal/kalman_update.h"

#include <Eigen/Cholesky>
#include <limits>
#include <optional>

#include "spartan/localization/internal/past_state.h"

namespace spartan::internal {
namespace {

using Gain = Eigen::Matrix<double, error_at::kSize, Eigen::Dynamic, 0, error_at::kSize, 6>;
using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;

struct Projection {
  Gain pht;
  Eigen::LLT<Square> s;
};

Projection project(const ErrorCovariance& p, const Innovation& innovation) {
  Gain pht = p * innovation.jacobian.transpose();
  Square s = innovation.jacobian * pht + innovation.noise;
  if (innovation.shared.cols() > 0) {
    const Square both = innovation.jacobian * innovation.shared;
    s += both + both.transpose();
    pht += innovation.shared;
  }
  return {pht, s.llt()};
}

// Transports the error of a pose to its mean after a correction, by J_r of its step.
void transport_columns(ErrorCovariance& p, const Matrix6d& reset, int index) {
  p.middleCols<6>(index) = (p.middleCols<6>(index) * reset.transpose()).eval();
}
void transport(ErrorCovariance& p, const Matrix6d& reset, int index) {
  p.middleRows<6>(index) = (reset * p.middleRows<6>(index)).eval();
  transport_columns(p, reset, index);
}

std::optional<Gain> kalman_gain(const ErrorCovariance& p, const Innovation& innovation) {
  const Projection projection = project(p, innovation);
  if (projection.s.info() != Eigen::Success) return std::nullopt;
  return projection.s.solve(projection.pht.transpose()).transpose();
}

bool correct_by(StateEstimate& estimate, const Innovation& innovation, const Gain& gain) {
  const ErrorVector step = gain * innovation.residual;
  if (!step.allFinite()) return false;
  ErrorCovariance keep = ErrorCovariance::Identity();
  keep.noalias() -= gain * innovation.jacobian;
  if (estimate.past) correct_past(*estimate.past, {innovation, estimate.covariance, gain, keep});
  ErrorCovariance half;
  half.noalias() = keep * estimate.covariance;
  estimate.covariance.noalias() = half * keep.transpose();
  estimate.covariance += gain * innovation.noise * gain.transpose();
  if (innovation.shared.cols() > 0) {
    half.noalias() = keep * innovation.shared * gain.transpose();
    estimate.covariance -= half + half.transpose();
  }
  for (const int pose : {error_at::kPose, error_at::kVisionClone, error_at::kStepClone}) {
    const Matrix6d reset = right_jacobian_se3(step.segment<6>(pose));
    transport(estimate.covariance, reset, pose);
    if (estimate.past) transport_columns(estimate.past->with_present, reset, pose);
  }
  symmetrize(estimate.covariance);
  estimate.state = add_error(estimate.state, step);
  return true;
}

}  // namespace

Innovation::Innovation(int rows) {
  residual.setZero(rows);
  jacobian.setZero(rows, error_at::kSize);
  noise.setZero(rows, rows);
}

double normalized_innovation_squared(const ErrorCovariance& covariance, const Innovation& innovation) {
  const Projection projection = project(covariance, innovation);
  if (projection.s.info() != Eigen::Success) return std::numeric_limits<double>::infinity();
  const double nis = innovation.residual.dot(projection.s.solve(innovation.residual));
  return nis >= 0 ? nis : std::numeric_limits<double>::infinity();
}

bool correct(StateEstimate& estimate, const Innovation& innovation) {
  const std::optional<Gain> gain = kalman_gain(estimate.covariance, innovation);
  return gain && correct_by(estimate, innovation, *gain);
}

bool correct_only(StateEstimate& estimate, const Innovation& innovation, int index) {
  const std::optional<Gain> gain = kalman_gain(estimate.covariance, innovation);
  if (!gain) return false;
  Gain partial = Gain::Zero(error_at::kSize, innovation.rows());
  partial.row(index) = gain->row(index);
  return correct_by(estimate, innovation, partial);
}

bool correct_all_but(StateEstimate& estimate, const Innovation& innovation, int first, int count) {
  std::optional<Gain> gain = kalman_gain(estimate.covariance, innovation);
  if (!gain) return false;
  gain->middleRows(first, count).setZero();
  return correct_by(estimate, innovation, *gain);
}

void symmetrize(ErrorCovariance& covariance) {
  covariance = (0.5 * (covariance + covariance.transpose())).eval();
}

}  // namespace spartan::internal
