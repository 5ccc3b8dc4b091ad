#include <algorithm>
#include <array>
#include <cmath>

#include "spartan/localization/internal/updates/vision_drift.h"
#include "spartan/localization/localizer.h"

namespace spartan {

using namespace internal;

namespace {

constexpr std::uint32_t kVersion = 3;
constexpr int kDrift = 6, kConstant = 12, kCalibration = 18;  // where z₁, z₂ and η begin

}  // namespace

Result<DeadReckoning> DeadReckoning::create(const VisionOptions& options) {
  if (Status valid = validate(options, "vision options"); !valid) return failure(valid);
  return DeadReckoning(options);
}

DeadReckoning::DeadReckoning(const VisionOptions& options)
    : white_noise_factor_(options.white_noise_factor),
      drift_correlation_frames_(options.drift_correlation_frames),
      drift_sigma_ratios_(six_sigma_ratios(options.drift_sigma_ratios)),
      constant_sigma_ratios_(six_sigma_ratios(options.constant_sigma_ratios)) {
  covariance_.diagonal().segment<6>(kDrift) = drift_sigma_ratios_.cwiseAbs2();
  covariance_.diagonal().segment<6>(kConstant) = constant_sigma_ratios_.cwiseAbs2();
  covariance_.diagonal().tail<kSize - kCalibration>().setOnes();
  at_reference_ = covariance_;
}

void DeadReckoning::add(const RelativeMotion& motion) {
  // Landmarks of a lost frame may be the only ones that are found again: then the motion begins there.
  if (motion.from != reference_) at_reference_ = covariance_;
  reference_ = motion.from;
  covariance_ = at_reference_;
  const Pose& moved = motion.previous_from_current;
  const bool drifts = motion.measured && !motion.is_stationary();
  if (drifts) {
    propagate_drift(covariance_, kDrift, drift_sigma_ratios_, drift_that_stays(drift_correlation_frames_));
    propagate_drift(covariance_, kConstant, constant_sigma_ratios_, drift_that_stays(kConstantDriftFrames));
  }
  const Matrix6d noise = motion.own_covariance();
  Covariance by = Covariance::Identity();
  by.topLeftCorner<6, 6>() = adjoint(moved.inverse());
  by.block<6, kSize - kCalibration>(0, kCalibration) = motion.by_calibration;
  if (drifts) {
    const Matrix6d deviations = motion.drift_scale().asDiagonal();
    by.block<6, 6>(0, kDrift) = deviations;
    by.block<6, 6>(0, kConstant) = deviations;
  }
  const Covariance propagated = by * covariance_ * by.transpose();
  covariance_ = 0.5 * (propagated + propagated.transpose());
  covariance_.topLeftCorner<6, 6>() +=
      0.5 * (motion.measured ? white_noise_factor_ : 1.0) * (noise + noise.transpose());
  if (motion.keeps_reference) return;
  at_reference_ = covariance_;
  reference_ = motion.to;
}

Bytes DeadReckoning::save() const {
  ArchiveWriter out;
  out.put(kVersion);
  for (const Covariance* covariance : {&covariance_, &at_reference_})
    out.put_array(covariance->data(), static_cast<std::size_t>(covariance->size()));
  out.put(reference_.ns);
  return out.take();
}

Status DeadReckoning::restore(const Bytes& bytes) {
  ArchiveReader in(bytes);
  const std::string what = "saved state of the dead reckoning";
  if (Status s = in.expect_version(kVersion, what); !s) return s;
  const std::array<std::vector<double>, 2> values{in.get_array<double>(), in.get_array<double>()};
  const Stamp reference = in.get_stamp();
  if (Status s = in.finish(what); !s) return s;
  for (const std::vector<double>& of : values) {
    const bool finite = std::all_of(of.begin(), of.end(), [](double value) { return std::isfinite(value); });
    if (!finite || of.size() != static_cast<std::size_t>(covariance_.size()))
      return failure(ErrorCode::store_damaged, "is damaged", what, "run again into a new folder");
  }
  covariance_ = Eigen::Map<const Covariance>(values[0].data());
  at_reference_ = Eigen::Map<const Covariance>(values[1].data());
  reference_ = reference;
  return {};
}

}  // namespace spartan
