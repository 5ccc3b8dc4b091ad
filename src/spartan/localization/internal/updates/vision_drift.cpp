#include "spartan/localization/internal/updates/vision_drift.h"

#include <cmath>
#include <stdexcept>

namespace spartan::internal {
namespace {

void step(StateEstimate& estimate, Vector6d& value, int index, const Vector6d& sigmas, double stays) {
  value *= stays;
  propagate_drift(estimate.covariance, index, sigmas, stays);
  if (estimate.past) estimate.past->with_present.middleCols<6>(index) *= stays;
}

}  // namespace

Vector6d six_sigma_ratios(const std::vector<double>& values) {
  if (values.size() != 6) throw std::invalid_argument("VisionOptions: a list of sigma ratios must have 6 numbers");
  return Eigen::Map<const Vector6d>(values.data());
}

double drift_that_stays(double correlation_frames) {
  return std::exp(-1 / correlation_frames);
}

VisionDrift::VisionDrift(const VisionOptions& options)
    : slow_sigmas_(six_sigma_ratios(options.drift_sigma_ratios)),
      constant_sigmas_(six_sigma_ratios(options.constant_sigma_ratios)),
      slow_stays_(drift_that_stays(options.drift_correlation_frames)) {}

void VisionDrift::start(ErrorCovariance& p) const {
  constexpr double kLeastDriftVariance = 1e-12;
  p.diagonal().segment<6>(error_at::kVisionDrift) = slow_sigmas_.cwiseAbs2().cwiseMax(kLeastDriftVariance);
  p.diagonal().segment<6>(error_at::kVisionConstant) = constant_sigmas_.cwiseAbs2().cwiseMax(kLeastDriftVariance);
}

void VisionDrift::propagate(StateEstimate& estimate) const {
  step(estimate, estimate.state.vision_drift, error_at::kVisionDrift, slow_sigmas_, slow_stays_);
  step(estimate, estimate.state.vision_constant, error_at::kVisionConstant, constant_sigmas_,
       drift_that_stays(kConstantDriftFrames));
}

}  // namespace spartan::internal
