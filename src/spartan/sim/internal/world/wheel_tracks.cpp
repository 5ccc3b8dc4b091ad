#include "spartan/sim/internal/world/wheel_tracks.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace spartan::sim::internal {
namespace {

constexpr double kCleat_m = 0.04;      // spacing of the prints of cleats
constexpr double kCleatDepth = 0.35;   // amplitude of the prints over the depth of the track
constexpr double kSoftEdge_m = 0.012;  // width of the border of a track

}  // namespace

WheelTracks::WheelTracks(std::span<const DrivenPose> poses, double until_s, const ChassisOptions& chassis,
                         const Region& region)
    : region_(region),
      depth_(static_cast<int>(std::ceil((region.x1 - region.x0) / kCell_m)) + 1,
             static_cast<int>(std::ceil((region.y1 - region.y0) / kCell_m)) + 1, 0.0F) {
  const double reach = 0.5 * chassis.track_m + chassis.wheel_width_m;
  for (const DrivenPose& driven : poses) {
    if (driven.time_s > until_s) break;
    if (region.grown(reach + chassis.wheelbase_m).contains(driven.pose.x, driven.pose.y)) press(driven, chassis);
  }
}

void WheelTracks::press(const DrivenPose& driven, const ChassisOptions& chassis) {
  const PlanarPose& at = driven.pose;
  const double c = std::cos(at.heading), s = std::sin(at.heading), half = 0.5 * chassis.wheel_width_m;
  const double cleats = 1 + kCleatDepth * std::sin(2 * std::numbers::pi * driven.driven_m / kCleat_m);
  for (const double left : {0.5 * chassis.track_m, -0.5 * chassis.track_m}) {
    for (const double ahead : {0.5 * chassis.wheelbase_m, -0.5 * chassis.wheelbase_m}) {
      for (double aside = -half; aside <= half; aside += kStep_m) {
        const double x = at.x + c * ahead - s * (left + aside), y = at.y + s * ahead + c * (left + aside);
        const int i = static_cast<int>(std::floor((x - region_.x0) / kCell_m + 0.5)),
                  j = static_cast<int>(std::floor((y - region_.y0) / kCell_m + 0.5));
        if (i < 0 || j < 0 || i >= depth_.width() || j >= depth_.height()) continue;
        const double edge = std::clamp((half - std::abs(aside)) / kSoftEdge_m, 0.0, 1.0);
        depth_(i, j) = std::max(depth_(i, j), static_cast<float>(chassis.track_depth_m * cleats * edge));
      }
    }
  }
}

double WheelTracks::depth(double x, double y) const {
  if (none()) return 0;
  const double u = (x - region_.x0) / kCell_m, v = (y - region_.y0) / kCell_m;
  if (!(u >= 0) || !(v >= 0) || u >= depth_.width() - 1 || v >= depth_.height() - 1) return 0;
  const int i = static_cast<int>(u), j = static_cast<int>(v);
  const double a = u - i, b = v - j;
  const auto at = [&](int x_index, int y_index) { return static_cast<double>(depth_(x_index, y_index)); };
  return (1 - b) * ((1 - a) * at(i, j) + a * at(i + 1, j)) + b * ((1 - a) * at(i, j + 1) + a * at(i + 1, j + 1));
}

}  // namespace spartan::sim::internal
