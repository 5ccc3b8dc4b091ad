#include "spartan/sim/internal/drive/driven_poses.h"

#include <algorithm>
#include <cmath>

namespace spartan::sim::internal {
namespace {

constexpr double kSample_s = 0.05;

PlanarPose interpolated(const PlanarPose& a, const PlanarPose& b, double part) {
  return {a.x + part * (b.x - a.x), a.y + part * (b.y - a.y), a.heading + part * (b.heading - a.heading)};
}

}  // namespace

std::vector<DrivenPose> driven_poses(const std::function<PlanarPose(double time_s)>& pose_at, double seconds,
                                     const ChassisOptions& chassis, double step_m) {
  // A turn moves the wheels on a circle about the middle of the body.
  const double radius_m = 0.5 * std::hypot(chassis.wheelbase_m, chassis.track_m);
  std::vector<DrivenPose> poses{{0, pose_at(0), 0}};
  PlanarPose before = poses[0].pose;
  double driven_m = 0;
  const auto samples = static_cast<int>(std::ceil(seconds / kSample_s));
  for (int i = 1; i <= samples; ++i) {
    const double before_s = (i - 1) * kSample_s, step_s = std::min(kSample_s, seconds - before_s);
    const PlanarPose here = pose_at(before_s + step_s);
    const double moved_m =
        std::hypot(here.x - before.x, here.y - before.y) + radius_m * std::abs(here.heading - before.heading);
    for (double due_m = poses.back().driven_m + step_m; due_m <= driven_m + moved_m; due_m += step_m) {
      const double part = (due_m - driven_m) / moved_m;
      poses.push_back({before_s + part * step_s, interpolated(before, here, part), due_m});
    }
    driven_m += moved_m;
    before = here;
  }
  return poses;
}

}  // namespace spartan::sim::internal
