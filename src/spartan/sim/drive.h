// The plan of a drive: when the rover is where, and when which camera looks.
#pragma once

#include <string>
#include <vector>

#include "spartan/core/options.h"
#include "spartan/core/result.h"
#include "spartan/rig/rig.h"
#include "spartan/sim/path.h"

namespace spartan::sim {

/// When pairs for odometry take pictures, and where the rover stops for panoramas.
struct ShotOptions {
  double frame_step_m = 0.1;
  double frame_turn_deg = 4;
  double frame_period_s = 1;
  double stop_every_m = 0;
  std::vector<double> stops_m = {};
  std::vector<double> pans_deg = {-35, 0, 35};
  double seconds_a_pan = 2;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("frame_step_m", frame_step_m, "driven between the frames of the pairs for odometry", between(0.005, 100));
    v.field("frame_turn_deg", frame_turn_deg, "turned on the spot between them", between(0.1, 90));
    v.field("frame_period_s", frame_period_s, "between them where the path says to stand", between(0.01, 1000));
    v.field("stop_every_m", stop_every_m, "the rover stops and pans at 0 and after each so many metres; 0: never",
            between(0, 10000));
    v.field("stops_m", stops_m, "and at these distances", at_least(0));
    v.field("pans_deg", pans_deg, "pans at a stop, positive to the left", between(-180, 180));
    v.field("seconds_a_pan", seconds_a_pan, "from pan to pan", between(0.1, 1000));
  }
};

/// One shot of one pair.
struct Shot {
  double time_s = 0;  ///< middle of the exposure
  std::string pair;
  std::int64_t position_id = 0;
  double pan_rad = 0, tilt_rad = 0;
};

class Drive {
 public:
  /// The rover rests so long before it moves, so that gravity can be measured.
  static constexpr double kRest_s = 2;

  /// Code `configuration` for a path that cannot be laid or that is shorter than a stop.
  static Result<Drive> plan(const PathOptions& path, const ShotOptions& shots, const Rig& rig);

  double seconds() const { return seconds_; }
  PlanarPose at(double time_s) const;
  /// In the order of time.
  const std::vector<Shot>& shots() const { return shots_; }
  /// Where the rover comes by, every Motion::kStep_m or less.
  std::vector<PlanarPose> track() const;

 private:
  struct Part {
    double from_s;
    Motion motion;
  };
  class Planner;
  std::vector<Part> parts_;
  std::vector<Shot> shots_;
  double seconds_ = 0;
};

}  // namespace spartan::sim
