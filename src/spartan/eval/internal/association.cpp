#include "spartan/eval/internal/association.h"

#include <fmt/format.h>

#include <cmath>

namespace spartan::internal {
namespace {

double distance_s(const StampedPose& a, const StampedPose& b) {
  return std::abs(seconds_between(a.stamp, b.stamp));
}

std::string time_range(const Trajectory& trajectory) {
  if (trajectory.empty()) return "no poses";
  return to_decimal_seconds(trajectory.front().stamp) + " … " + to_decimal_seconds(trajectory.back().stamp) + " s";
}

}  // namespace

Result<AssociatedTrajectories> associate(const Trajectory& estimate, const Trajectory& truth, double max_dt_s) {
  AssociatedTrajectories pairs;
  std::size_t nearest = 0, last_used = truth.size();
  for (const StampedPose& entry : estimate) {
    while (nearest + 1 < truth.size() && distance_s(entry, truth[nearest + 1]) < distance_s(entry, truth[nearest])) {
      ++nearest;
    }
    if (truth.empty() || distance_s(entry, truth[nearest]) > max_dt_s) continue;
    if (last_used == nearest) {  // the truth pose is already paired with the previous estimate
      if (distance_s(pairs.estimate.back(), truth[nearest]) > distance_s(entry, truth[nearest])) {
        pairs.estimate.back() = entry;
      }
      continue;
    }
    last_used = nearest;
    pairs.estimate.push_back(entry);
    pairs.truth.push_back(truth[nearest]);
  }
  if (pairs.estimate.empty()) {
    return failure(ErrorCode::input,
                   fmt::format("no pose of the estimate is within {} s of a pose of the truth", max_dt_s), {},
                   fmt::format("estimate: {}; truth: {}", time_range(estimate), time_range(truth)));
  }
  return pairs;
}

}  // namespace spartan::internal
