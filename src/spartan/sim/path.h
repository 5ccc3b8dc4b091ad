// The rover's path in the world plane over time.
#pragma once

#include <utility>
#include <vector>

#include "spartan/core/result.h"
#include "spartan/sim/scenario_options.h"

namespace spartan::sim {

/// Position and heading in the world plane; the heading is counter-clockwise from x.
struct PlanarPose {
  double x = 0, y = 0, heading = 0;  ///< m, m, rad
};

/// One uninterrupted motion: driving along a curve, turning in place, or being stationary.
/// The speed profile is twice continuously differentiable and begins and ends at zero.
class Motion {
 public:
  static constexpr double kStep_m = 0.01;  ///< m; spacing of a curve's points
  static Motion stationary(const PlanarPose& at, double seconds);
  static Motion turn(const PlanarPose& at, double angle_rad, double rate_rad_s, double ramp_s);
  /// Along points spaced kStep_m; the last step may be shorter.
  static Motion drive(std::vector<PlanarPose> curve, double speed_m_s, double ramp_s);

  double seconds() const { return seconds_; }
  /// Metres driven, or radians turned, at a time since the start of the motion.
  double progress(double t) const;
  PlanarPose at(double t) const;
  bool drives() const { return !curve_.empty(); }
  /// Metres or radians of the whole motion.
  double amount() const { return amount_; }
  /// The time at which a progress is reached, to 1 µs.
  double time_of(double target_progress) const;

 private:
  PlanarPose start_;
  std::vector<PlanarPose> curve_;
  double amount_ = 0, turn_sign_ = 1;  // metres or radians
  double rate_ = 0, ramp_s_ = 0, seconds_ = 0;
};

/// A curve to drive, a turn in place, or a pause.
struct PathLeg {
  std::vector<PlanarPose> curve;  ///< empty: a turn in place or a pause
  double turn_rad = 0;
  double rest_s = 0;
};
/// The legs of a path in order. Errors: `configuration` for waypoints that make no path.
Result<std::vector<PathLeg>> lay_path(const PathOptions& options);

/// Driven length of a curve.
double curve_length(const std::vector<PlanarPose>& curve);
/// The first `metres` of a curve, and the remainder.
std::pair<std::vector<PlanarPose>, std::vector<PlanarPose>> cut(const std::vector<PlanarPose>& curve, double metres);

}  // namespace spartan::sim
