#include "spartan/localization/internal/alignment_window.h"

#include <Eigen/LU>
#include <algorithm>

namespace spartan::internal {
namespace {

/// Segments that are kept: one second of a fast camera, a metre of a slow rover.
constexpr std::size_t kMaxSegments = 40;
/// Largest change of the nominal rotation by the gyro's bias that is corrected to first order.
constexpr double kLinearRotation_rad = 0.01;

}  // namespace

ImuSample interpolate(const ImuSample& a, const ImuSample& b, Stamp at) {
  const double whole = seconds_between(a.stamp, b.stamp);
  const double part = whole > 0 ? std::clamp(seconds_between(a.stamp, at) / whole, 0.0, 1.0) : 1.0;
  return {at, a.gyro_rad_s + part * (b.gyro_rad_s - a.gyro_rad_s), a.accel_m_s2 + part * (b.accel_m_s2 - a.accel_m_s2)};
}

void AlignmentWindow::begin(Stamp frame) {
  const Eigen::Vector3d gyro_bias = state_.current.gyro_bias_rad_s;  // still the best nominal bias
  state_.segments.clear();
  state_.frames.clear();
  state_.open = true;
  state_.begin = state_.newest = frame;
  state_.current = {};
  state_.current.gyro_bias_rad_s = gyro_bias;
}

void AlignmentWindow::add(const RelativeMotion& motion) {
  if (!motion.measured && motion.keeps_reference) return;
  if (!state_.open || !motion.measured || motion.from != state_.newest) {
    begin(motion.to);
    return;
  }
  state_.frames.push_back({motion.to, {motion.previous_from_current, motion.covariance, {}}});
  state_.newest = motion.to;
}

void AlignmentWindow::integrate(const ImuSample& from, const ImuSample& to, const InertialNoise& noise) {
  const double seconds = seconds_between(from.stamp, to.stamp);
  if (seconds > 0) state_.current.add({from.gyro_rad_s, to.gyro_rad_s, from.accel_m_s2, to.accel_m_s2, seconds}, noise);
}

void AlignmentWindow::complete(const Frame& frame) {
  AlignmentSegment segment = frame.segment;
  segment.inertial = state_.current;
  const Preintegration& imu = segment.inertial;
  Eigen::Vector3d nominal = imu.gyro_bias_rad_s;
  if (imu.seconds > 0) {
    const Eigen::Vector3d turn =
        log_so3(Eigen::Quaterniond(imu.rotation.transpose() * segment.motion.rotation_matrix()));
    if (turn.norm() <= kLinearRotation_rad) {
      if (state_.segments.size() == kMaxSegments) state_.segments.erase(state_.segments.begin());
      state_.segments.push_back(segment);
    } else {
      state_.segments.clear();
      nominal += imu.rotation_by_gyro.inverse() * turn;
    }
  }
  state_.begin = frame.stamp;
  state_.current = {};
  state_.current.gyro_bias_rad_s = nominal;
}

bool AlignmentWindow::add(const ImuSample& before, const ImuSample& sample, const InertialNoise& noise,
                          double timeout_s) {
  if (!state_.open) return false;
  const bool begins_before_readings = state_.current.seconds == 0 && state_.begin < before.stamp;
  if (seconds_between(before.stamp, sample.stamp) > timeout_s || begins_before_readings) {
    begin(state_.newest);
    state_.open = false;
    return false;
  }
  ImuSample from = interpolate(before, sample, std::max(before.stamp, state_.begin));
  const std::size_t count = state_.frames.size();
  for (const Frame& frame : std::vector<Frame>(std::move(state_.frames))) {
    const ImuSample at = interpolate(before, sample, frame.stamp);
    integrate(from, at, noise);
    complete(frame);
    from = at;
  }
  state_.frames.clear();
  integrate(from, sample, noise);
  return count > 0;
}

std::optional<InertialAlignment> AlignmentWindow::align(const AlignmentPrior& prior) const {
  return align_inertially(state_.segments, prior);
}

double AlignmentWindow::seconds() const {
  double sum = 0;
  for (const AlignmentSegment& s : state_.segments) sum += s.inertial.seconds;
  return sum;
}

bool AlignmentWindow::is_full() const {
  return state_.segments.size() >= kMaxSegments;
}

}  // namespace spartan::internal
