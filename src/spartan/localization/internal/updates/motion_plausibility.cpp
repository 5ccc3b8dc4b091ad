#include "spartan/localization/internal/updates/motion_plausibility.h"

#include <algorithm>

namespace spartan::internal {
namespace {

/// A motion is implausible where it differs from all that a speed between zero and the last one can explain by more
/// than this multiple of the recent length (a reversal: twice) and this length. The length fades by kLengthFades with
/// each motion; it is known after kRecentMotions.
constexpr double kImplausibleFactor = 2, kImplausible_m = 0.1, kLengthFades = 0.9;
constexpr std::uint32_t kRecentMotions = 3;

}  // namespace

bool is_implausible(const RecentMotion& recent, const RelativeMotion& motion) {
  if (recent.count < kRecentMotions || motion.is_stationary()) return false;
  const double seconds = seconds_between(std::min(recent.end, motion.from), motion.to);
  const Eigen::Vector3d way = recent.velocity_m_s * seconds, moved = motion.previous_from_current.translation();
  const double part = std::clamp(moved.dot(way) / std::max(way.squaredNorm(), 1e-12), 0.0, 1.0);
  return (moved - part * way).norm() > kImplausibleFactor * recent.length_m + kImplausible_m;
}

void remember(RecentMotion& recent, const RelativeMotion& motion, bool uncertain) {
  if (motion.is_stationary()) return;
  const Pose& moved = motion.previous_from_current;
  double length = moved.translation().norm();
  if (uncertain) length = std::min(length, kImplausibleFactor * recent.length_m + kImplausible_m);
  recent.length_m = std::max(kLengthFades * recent.length_m, length);
  recent.count = std::min(recent.count + 1, kRecentMotions);
  recent.velocity_m_s = length / std::max(seconds_between(motion.from, motion.to), 1e-3) *
                        (moved.rotation().conjugate() * moved.translation().stableNormalized());
  recent.end = motion.to;
}

}  // namespace spartan::internal
