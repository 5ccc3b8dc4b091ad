#include "spartan/sim/internal/drive/wheel_lift.h"

#include <algorithm>
#include <cmath>

namespace spartan::sim::internal {
namespace {

constexpr int kAlong = 8, kAcross = 1;  // samples to either side of the wheel's centre

double semi_major_axis(const Rock& rock) {
  return 0.5 * rock.diameter_m * std::sqrt(rock.elongation);
}

double height_over(const Rock& rock, double x, double y) {
  const double dx = x - rock.x, dy = y - rock.y;
  const double c = std::cos(rock.turn_rad), s = std::sin(rock.turn_rad);
  const double along = (c * dx + s * dy) / semi_major_axis(rock),
               across = (c * dy - s * dx) / (semi_major_axis(rock) / rock.elongation);
  const double inside = 1 - along * along - across * across;
  return inside > 0 ? rock.height_m * std::sqrt(inside) : 0;
}

}  // namespace

WheelLift::WheelLift(const std::vector<Rock>& rocks, double wheel_radius_m, double wheel_width_m)
    : radius_m_(wheel_radius_m), width_m_(wheel_width_m) {
  for (const Rock& rock : rocks) {
    if (rock.height_m < kPressedIn_m) continue;
    rocks_.add(rock.x, rock.y, rock);
    largest_reach_m_ = std::max(largest_reach_m_, semi_major_axis(rock));
  }
}

double WheelLift::rocks_over(double x, double y) const {
  double height = 0;
  rocks_.any_near(Region{x, y, x, y}.grown(largest_reach_m_), [&](const Rock& rock) {
    height = std::max(height, height_over(rock, x, y));
    return false;
  });
  return height;
}

double WheelLift::at(double x, double y, double heading) const {
  const double c = std::cos(heading), s = std::sin(heading);
  double lift = 0;
  for (int i = -kAlong; i <= kAlong; ++i) {
    const double before = radius_m_ * i / kAlong, rim = radius_m_ - std::sqrt(radius_m_ * radius_m_ - before * before);
    for (int j = -kAcross; j <= kAcross; ++j) {
      const double aside = 0.5 * width_m_ * j / kAcross;
      lift = std::max(lift, rocks_over(x + c * before - s * aside, y + s * before + c * aside) - rim);
    }
  }
  return lift;
}

}  // namespace spartan::sim::internal
