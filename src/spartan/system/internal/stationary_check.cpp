#include "spartan/system/internal/stationary_check.h"

#include <algorithm>
#include <cmath>

namespace spartan::internal {
namespace {

constexpr double kStill_m_s = 0.005, kStill_rad_s = 0.03, kDrives_m_s = 0.03, kDrives_rad_s = 0.1;

}  // namespace

void StationaryCheck::note(Stamp stamp, double speed_m_s, double rate_rad_s) {
  newest_ = std::max(newest_.value_or(stamp), stamp);
  const bool moves = speed_m_s > kStill_m_s || rate_rad_s > kStill_rad_s;
  if (moves || !moved_at_) moved_at_ = std::max(moved_at_.value_or(stamp), stamp);
  drives_ = speed_m_s > kDrives_m_s || rate_rad_s > kDrives_rad_s;
}

void StationaryCheck::add(const RoverMotion& motion) {
  speed_at_ = std::max(speed_at_.value_or(motion.stamp), motion.stamp);
  const bool drove = drives_;
  note(motion.stamp, motion.velocity.head<3>().norm(), motion.velocity.tail<3>().norm());
  // The mean over a long interval does not tell when the rover moved.
  const bool is_recent = frame_at_ && seconds_between(*frame_at_, motion.stamp) <= kStill_s;
  if (!is_recent) drives_ = drove;
  frame_at_ = motion.stamp;
}

void StationaryCheck::add(const ImuSample& sample) {
  note(sample.stamp, 0, sample.gyro_rad_s.norm());
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
  note(sample.stamp, moved_m / seconds, 0);
}

bool StationaryCheck::is_stationary() const {
  return speed_at_ && seconds_between(*speed_at_, *newest_) < 2 * kStill_s &&
         seconds_between(*moved_at_, *newest_) >= kStill_s;
}

}  // namespace spartan::internal
