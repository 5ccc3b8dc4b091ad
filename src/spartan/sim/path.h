// Where the rover goes, seen from above, over time.
#pragma once

#include <string>
#include <vector>

#include "spartan/core/options.h"
#include "spartan/core/result.h"

namespace spartan::sim {

/// Paths begin at the world's origin, heading along x.
struct PathOptions {
  std::string kind = "straight";
  double length_m = 15;
  double turn_deg = 90;
  double swing_deg = 20;
  double wavelength_m = 8;
  std::vector<double> waypoints_m = {};
  double leg_m = 1;
  double growth_m = 0.5;
  int legs = 8;
  double standing_s = 30;
  double speed_m_s = 0.06;
  double turn_rate_deg_s = 5;
  double ramp_s = 2;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("kind", kind, "the path's shape",
            {"straight", "arc", "winding", "waypoints", "loop", "square_spiral", "turn_in_place", "standing"});
    v.field("length_m", length_m, "of straight, arc, winding and loop", between(0.1, 20000));
    v.field("turn_deg", turn_deg, "of arc and turn_in_place: change of heading over the whole path, left positive",
            between(-3600, 3600));
    v.field("swing_deg", swing_deg, "of winding: largest heading to either side", between(0, 80));
    v.field("wavelength_m", wavelength_m, "of winding: from swing to swing", between(0.5, 1000));
    v.field("waypoints_m", waypoints_m, "of waypoints: x, y, x, y … after the start, joined by a smooth curve");
    v.field("leg_m", leg_m, "of square_spiral: the first leg", between(0.1, 1000));
    v.field("growth_m", growth_m, "of square_spiral: each leg is so much longer", between(0, 1000));
    v.field("legs", legs, "of square_spiral: how many", between(1, 1000));
    v.field("standing_s", standing_s, "of standing: how long", between(0.1, 100000));
    v.field("speed_m_s", speed_m_s, "when driving", between(0.001, 5));
    v.field("turn_rate_deg_s", turn_rate_deg_s, "when turning on the spot", between(0.1, 180));
    v.field("ramp_s", ramp_s, "time to full speed and from it", between(0.1, 60));
  }
};

struct PlanarPose {
  double x = 0, y = 0, heading = 0;  ///< m, m, rad
};

/// One uninterrupted motion: a curve driven, a turn on the spot, or nothing.
/// The speed rises and falls smoothly (its third derivative exists), so that a motion begins and ends at rest.
class Motion {
 public:
  static Motion stand(const PlanarPose& at, double seconds);
  static Motion turn(const PlanarPose& at, double angle_rad, double rate_rad_s, double ramp_s);
  /// Along points spaced kStep_m; `from_m` and `to_m` bound the part that is driven.
  static constexpr double kStep_m = 0.01;
  static Motion drive(std::vector<PlanarPose> curve, double speed_m_s, double ramp_s);

  double seconds() const { return seconds_; }
  /// Metres driven, or radians turned, at a time since the motion's start.
  double progress(double t) const;
  PlanarPose at(double t) const;
  bool drives() const { return !curve_.empty(); }
  double amount() const { return amount_; }
  /// When the progress reaches a value, to 1 µs.
  double time_of(double progress_wanted) const;

 private:
  PlanarPose start_;
  std::vector<PlanarPose> curve_;
  double amount_ = 0, turn_sign_ = 1;  // metres or radians
  double rate_ = 0, ramp_s_ = 0, seconds_ = 0;
};

/// A curve to drive, a turn on the spot, or a rest.
struct PathLeg {
  std::vector<PlanarPose> curve;  ///< empty: a turn on the spot or a rest
  double turn_rad = 0;
  double rest_s = 0;
};
/// The legs of a path in order. Code `configuration` for waypoints that make no path.
Result<std::vector<PathLeg>> lay_path(const PathOptions& options);

/// Length driven along a curve's points.
double curve_length(const std::vector<PlanarPose>& curve);
/// The first `metres` of a curve and the rest of it.
std::pair<std::vector<PlanarPose>, std::vector<PlanarPose>> cut(const std::vector<PlanarPose>& curve, double metres);

}  // namespace spartan::sim
