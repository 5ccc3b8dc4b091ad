#include "spartan/system/internal/stationary_check.h"

#include <algorithm>
#include <cmath>

namespace spartan::internal {
namespace {

constexpr double kStill_m_s = 0.005, kStill_rad_s = 0.03, kDrives_m_s = 0.03, kDrives_rad_s = 0.1;
// RMS of the gyroscope around its mean; that of a drone's at rest (EuRoC) is 0.012.
constexpr double kStillScatter_rad_s = 0.02;

}  // namespace

void StationaryCheck::note(Stamp stamp, bool moves, bool drives) {
  newest_ = std::max(newest_.value_or(stamp), stamp);
  if (moves || !moved_at_) moved_at_ = std::max(moved_at_.value_or(stamp), stamp);
  drives_ = drives;
}

void StationaryCheck::add(const RoverMotion& motion) {
  speed_at_ = std::max(speed_at_.value_or(motion.stamp), motion.stamp);
  const double speed_m_s = motion.velocity.head<3>().norm(), rate_rad_s = motion.velocity.tail<3>().norm();
  // The mean over a long interval does not tell when the rover moved.
  const bool is_recent = frame_at_ && seconds_between(*frame_at_, motion.stamp) <= kStill_s;
  const bool drives = speed_m_s > kDrives_m_s || rate_rad_s > kDrives_rad_s;
  note(motion.stamp, speed_m_s > kStill_m_s || rate_rad_s > kStill_rad_s, is_recent ? drives : drives_);
  frame_at_ = motion.stamp;
}

// One sample from before kStill_s remains, so that a gap is not taken for a rest.
void StationaryCheck::add(const ImuSample& sample) {
  const bool drives = !gyro_.empty() && (sample.gyro_rad_s - mean_rate()).norm() > kDrives_rad_s;
  gyro_.push_back(sample);
  while (gyro_.size() > 1 && seconds_between(gyro_[1].stamp, sample.stamp) >= kStill_s) gyro_.pop_front();
  note(sample.stamp, false, drives);
}

// The mean speed over kStill_s, so that the steps of an encoder are not taken for a motion.
void StationaryCheck::add(const WheelSample& sample) {
  wheels_.push_back(sample);
  while (seconds_between(wheels_.front().stamp, sample.stamp) > kStill_s) wheels_.pop_front();
  const WheelSample& first = wheels_.front();
  const double seconds = seconds_between(first.stamp, sample.stamp);
  if (seconds < 0.5 * kStill_s) return;
  speed_at_ = std::max(speed_at_.value_or(sample.stamp), sample.stamp);
  const double moved_m = std::max(std::abs(sample.left_m - first.left_m), std::abs(sample.right_m - first.right_m));
  const double speed_m_s = moved_m / seconds;
  note(sample.stamp, speed_m_s > kStill_m_s, speed_m_s > kDrives_m_s);
}

Eigen::Vector3d StationaryCheck::mean_rate() const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : gyro_) sum += sample.gyro_rad_s;
  return sum / static_cast<double>(gyro_.size());
}

bool StationaryCheck::gyro_varies() const {
  if (gyro_.empty()) return false;
  const Eigen::Vector3d mean = mean_rate();
  double sum = 0;
  for (const ImuSample& sample : gyro_) sum += (sample.gyro_rad_s - mean).squaredNorm();
  return std::sqrt(sum / static_cast<double>(gyro_.size())) > kStillScatter_rad_s;
}

StationaryCheck::State StationaryCheck::state() const {
  if (!speed_at_ || seconds_between(*speed_at_, *newest_) >= 2 * kStill_s) return State::unknown;
  if (seconds_between(*moved_at_, *newest_) < kStill_s) return State::moves;
  return gyro_varies() ? State::shaken : State::stationary;
}

}  // namespace spartan::internal
