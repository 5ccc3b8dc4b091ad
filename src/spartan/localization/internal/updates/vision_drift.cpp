#include "spartan/localization/internal/updates/vision_drift.h"

#include <cmath>
#include <stdexcept>

namespace spartan::internal {
namespace {

/// Correlation length of the constant error of vision, in frames: finite, so that the filter does not become
/// overconfident; empirical.
constexpr double kConstantFrames = 5000;

Vector6d six_of(const std::vector<double>& values) {
  if (values.size() != 6) throw std::invalid_argument("VisionOptions: a list of sigma ratios must have 6 numbers");
  return Eigen::Map<const Vector6d>(values.data());
}

/// One step of a Gauss–Markov process.
void step(StateEstimate& estimate, Vector6d& value, int index, const Vector6d& sigmas, double frames) {
  const double stays = std::exp(-1 / frames);
  ErrorCovariance& p = estimate.covariance;
  value *= stays;
  p.middleRows<6>(index) *= stays;
  p.middleCols<6>(index) *= stays;
  if (estimate.past) estimate.past->with_present.middleCols<6>(index) *= stays;
  p.diagonal().segment<6>(index) += (1 - stays * stays) * sigmas.cwiseAbs2();
}

}  // namespace

VisionDrift::VisionDrift(const VisionOptions& options)
    : slow_sigmas_(six_of(options.drift_sigma_ratios)),
      constant_sigmas_(six_of(options.constant_sigma_ratios)),
      slow_frames_(options.drift_correlation_frames) {}

void VisionDrift::start(ErrorCovariance& p) const {
  constexpr double kLeastDriftVariance = 1e-12;
  p.diagonal().segment<6>(error_at::kVisionDrift) = slow_sigmas_.cwiseAbs2().cwiseMax(kLeastDriftVariance);
  p.diagonal().segment<6>(error_at::kVisionConstant) = constant_sigmas_.cwiseAbs2().cwiseMax(kLeastDriftVariance);
}

void VisionDrift::propagate(StateEstimate& estimate) const {
  step(estimate, estimate.state.vision_drift, error_at::kVisionDrift, slow_sigmas_, slow_frames_);
  step(estimate, estimate.state.vision_constant, error_at::kVisionConstant, constant_sigmas_, kConstantFrames);
}

}  // namespace spartan::internal
