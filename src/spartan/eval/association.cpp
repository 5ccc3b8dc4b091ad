#include "spartan/eval/association.h"

#include <fmt/format.h>

#include <cmath>

namespace spartan {
namespace {

double distance_s(const StampedPose& a, const StampedPose& b) {
  return std::abs(seconds_between(a.stamp, b.stamp));
}

std::string span(const Trajectory& trajectory) {
  if (trajectory.empty()) return "nothing";
  return to_decimal_seconds(trajectory.front().stamp) + " … " + to_decimal_seconds(trajectory.back().stamp) + " s";
}

}  // namespace

Result<AssociatedTrajectories> associate(const Trajectory& estimate, const Trajectory& truth, double max_dt_s) {
  AssociatedTrajectories pairs;
  std::size_t nearest = 0, taken = truth.size();
  for (const StampedPose& entry : estimate) {
    while (nearest + 1 < truth.size() && distance_s(entry, truth[nearest + 1]) < distance_s(entry, truth[nearest])) {
      ++nearest;
    }
    if (truth.empty() || distance_s(entry, truth[nearest]) > max_dt_s) continue;
    if (taken == nearest) {  // the truth pose has a partner already, from before
      if (distance_s(pairs.estimate.back(), truth[nearest]) > distance_s(entry, truth[nearest])) {
        pairs.estimate.back() = entry;
      }
      continue;
    }
    taken = nearest;
    pairs.estimate.push_back(entry);
    pairs.truth.push_back(truth[nearest]);
  }
  if (pairs.estimate.empty()) {
    return failure(ErrorCode::input,
                   fmt::format("no pose of the estimate lies within {} s of one of the truth", max_dt_s), {},
                   fmt::format("estimate: {}; truth: {}", span(estimate), span(truth)));
  }
  return pairs;
}

}  // namespace spartan
