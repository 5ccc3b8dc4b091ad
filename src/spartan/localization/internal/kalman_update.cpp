#include "spartan/localization/internal/kalman_update.h"

#include <Eigen/Cholesky>
#include <limits>
#include <optional>

namespace spartan {
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

// The error of a pose after its mean has moved by `step`.
void carry_over(ErrorCovariance& p, const ErrorVector& step, int index) {
  const Matrix6d reset = right_jacobian_se3(step.segment<6>(index));
  p.middleRows<6>(index) = (reset * p.middleRows<6>(index)).eval();
  p.middleCols<6>(index) = (p.middleCols<6>(index) * reset.transpose()).eval();
}

std::optional<Gain> kalman_gain(const ErrorCovariance& p, const Innovation& innovation) {
  const Projection projection = project(p, innovation);
  if (projection.s.info() != Eigen::Success) return std::nullopt;
  return projection.s.solve(projection.pht.transpose()).transpose();
}

bool correct_by(Belief& belief, const Innovation& innovation, const Gain& gain) {
  const ErrorVector step = gain * innovation.residual;
  if (!step.allFinite()) return false;
  ErrorCovariance keep = ErrorCovariance::Identity();
  keep.noalias() -= gain * innovation.jacobian;
  ErrorCovariance half;
  half.noalias() = keep * belief.covariance;
  belief.covariance.noalias() = half * keep.transpose();
  belief.covariance += gain * innovation.noise * gain.transpose();
  if (innovation.shared.cols() > 0) {
    half.noalias() = keep * innovation.shared * gain.transpose();
    belief.covariance -= half + half.transpose();
  }
  for (const int pose : {error_at::kPose, error_at::kVisionClone, error_at::kStepClone})
    carry_over(belief.covariance, step, pose);
  symmetrise(belief.covariance);
  belief.state = add_error(belief.state, step);
  return true;
}

}  // namespace

Innovation::Innovation(int rows) {
  residual.setZero(rows);
  jacobian.setZero(rows, error_at::kSize);
  noise.setZero(rows, rows);
}

double normalised_square(const ErrorCovariance& covariance, const Innovation& innovation) {
  const Projection projection = project(covariance, innovation);
  if (projection.s.info() != Eigen::Success) return std::numeric_limits<double>::infinity();
  const double square = innovation.residual.dot(projection.s.solve(innovation.residual));
  return square >= 0 ? square : std::numeric_limits<double>::infinity();
}

bool correct(Belief& belief, const Innovation& innovation) {
  const std::optional<Gain> gain = kalman_gain(belief.covariance, innovation);
  return gain && correct_by(belief, innovation, *gain);
}

bool correct_only(Belief& belief, const Innovation& innovation, int index) {
  const std::optional<Gain> gain = kalman_gain(belief.covariance, innovation);
  if (!gain) return false;
  Gain partial = Gain::Zero(error_at::kSize, innovation.rows());
  partial.row(index) = gain->row(index);
  return correct_by(belief, innovation, partial);
}

bool correct_all_but(Belief& belief, const Innovation& innovation, int first, int count) {
  std::optional<Gain> gain = kalman_gain(belief.covariance, innovation);
  if (!gain) return false;
  gain->middleRows(first, count).setZero();
  return correct_by(belief, innovation, *gain);
}

void symmetrise(ErrorCovariance& covariance) {
  covariance = (0.5 * (covariance + covariance.transpose())).eval();
}

}  // namespace spartan
