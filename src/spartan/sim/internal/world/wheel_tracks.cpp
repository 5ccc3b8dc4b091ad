#include "spartan/sim/internal/world/wheel_tracks.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace spartan::sim::internal {
namespace {

constexpr double kCleat_m = 0.04;      // spacing of the prints of cleats
constexpr double kCleatDepth = 0.35;   // amplitude of the prints over the depth of the track
constexpr double kSoftEdge_m = 0.012;  // width of the border of a track
constexpr double kStep_m = 0.5 * WheelTracks::kCell_m, kStep_s = 0.02;

}  // namespace

WheelTracks::WheelTracks(const Drive& drive, double until_s, const ChassisOptions& chassis, const Region& region)
    : region_(region),
      depth_(static_cast<int>(std::ceil((region.x1 - region.x0) / kCell_m)) + 1,
             static_cast<int>(std::ceil((region.y1 - region.y0) / kCell_m)) + 1, 0.0F) {
  const double reach = 0.5 * chassis.track_m + chassis.wheel_width_m;
  PlanarPose before = drive.at(0);
  double driven_m = 0, pressed_m = -1;
  for (double t = 0; t <= until_s; t += kStep_s) {
    const PlanarPose here = drive.at(t);
    // In turns in place the wheels move by the turn alone.
    driven_m += std::hypot(here.x - before.x, here.y - before.y) +
                0.5 * chassis.track_m * std::abs(here.heading - before.heading);
    before = here;
    if (driven_m < pressed_m + kStep_m) continue;
    pressed_m = driven_m;
    if (region.grown(reach + chassis.wheelbase_m).contains(here.x, here.y)) press(here, driven_m, chassis);
  }
}

void WheelTracks::press(const PlanarPose& at, double driven_m, const ChassisOptions& chassis) {
  const double c = std::cos(at.heading), s = std::sin(at.heading), half = 0.5 * chassis.wheel_width_m;
  const double cleats = 1 + kCleatDepth * std::sin(2 * std::numbers::pi * driven_m / kCleat_m);
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
