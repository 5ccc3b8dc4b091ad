#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "spartan/core/pose.h"
#include "spartan/sim/scenario.h"

namespace spartan::sim {
namespace {

constexpr double kSettle_s = 0.5;  // stationary before and after the frames of a stop; empirical
constexpr double kSame_m = 0.005;  // tolerance between distances: half of Motion::kStep_m

}  // namespace

// Appends motion after motion and plans the frames.
class Drive::Planner {
 public:
  Planner(const PathOptions& path, const CaptureOptions& options, const Rig& rig)
      : path_(path), options_(options), rig_(rig) {}

  Result<Drive> plan() {
    auto legs = lay_path(path_);
    if (!legs) return failure(legs);
    if (path_.end_after_m > 0) shorten(*legs, path_.end_after_m);
    double length = 0;
    for (const PathLeg& leg : *legs) length += curve_length(leg.curve);
    if (Status s = find_stops(length); !s) return failure(s);
    if (path_.initial_stop_s > 0) add(Motion::stationary(here_, path_.initial_stop_s));
    capture_at_halt();
    for (const PathLeg& leg : *legs) {
      if (!leg.curve.empty()) {
        drive_along(leg.curve);
      } else if (leg.turn_rad != 0) {
        turn_in_place(leg.turn_rad);
      } else {
        pause(leg.rest_s);
      }
    }
    add(Motion::stationary(here_, kSettle_s));
    return std::move(drive_);
  }

 private:
  // Removes what is beyond a distance along the legs.
  static void shorten(std::vector<PathLeg>& legs, double length_m) {
    for (auto leg = legs.begin(); leg != legs.end(); ++leg) {
      const double here_m = curve_length(leg->curve);
      if (here_m >= length_m - kSame_m) {
        if (here_m > length_m + kSame_m) leg->curve = cut(leg->curve, length_m).first;
        legs.erase(leg + 1, legs.end());
        return;
      }
      length_m -= here_m;
    }
  }

  Status find_stops(double length) {
    for (const double at : options_.stops_m) {
      if (at > length + kSame_m) {
        return failure(ErrorCode::configuration,
                       fmt::format("the stop at {} m is beyond the end of the path at {:.2f} m", at, length),
                       "capture.stops_m");
      }
      stops_.push_back(at);
    }
    if (options_.stop_every_m > 0) {
      for (int i = 0; i * options_.stop_every_m <= length + kSame_m; ++i) stops_.push_back(i * options_.stop_every_m);
    }
    std::sort(stops_.begin(), stops_.end());
    return {};
  }

  bool is_stop(double metres) const {
    const auto stop = std::upper_bound(stops_.begin(), stops_.end(), metres - kSame_m);
    return stop != stops_.end() && *stop < metres + kSame_m;
  }

  void add(const Motion& motion) {
    drive_.segments_.push_back({drive_.seconds_, motion});
    drive_.seconds_ += motion.seconds();
    here_ = motion.at(motion.seconds());
  }

  // A frame of every odometry pair.
  void add_odometry_frames(double time_s) {
    for (const StereoPair& pair : rig_.pairs) {
      if (pair.for_odometry) drive_.frames_.push_back({time_s, pair.name, position_id_, 0, 0});
    }
  }

  // Stationary: a frame of the odometry pairs, and at a stop the pans of the other pairs.
  void capture_at_halt() {
    ++position_id_;
    add(Motion::stationary(here_, kSettle_s));
    add_odometry_frames(drive_.seconds_);
    if (!is_stop(driven_)) return;
    for (const double pan_deg : options_.pans_deg) {
      add(Motion::stationary(here_, options_.pan_period_s));
      for (const StereoPair& pair : rig_.pairs) {
        if (!pair.for_odometry) {
          drive_.frames_.push_back(
              {drive_.seconds_, pair.name, position_id_, pan_deg * kRadiansPerDegree, tilt_of(pair)});
        }
      }
    }
    add(Motion::stationary(here_, kSettle_s));
  }

  double tilt_of(const StereoPair& pair) const {
    const std::string& mount = rig_.find_camera(pair.left)->mount;
    for (const PanTiltUnit& unit : rig_.pan_tilt_units) {
      if (unit.name == mount) return unit.rest_tilt_rad;
    }
    return 0;
  }

  void drive_along(std::vector<PlanarPose> curve) {
    while (curve.size() > 1) {
      const double remaining = curve_length(curve);
      const auto next = std::find_if(stops_.begin(), stops_.end(), [&](double s) { return s > driven_ + kSame_m; });
      std::vector<PlanarPose> part = curve, later;
      if (next != stops_.end() && *next < driven_ + remaining - kSame_m)
        std::tie(part, later) = cut(curve, *next - driven_);
      const Motion motion = Motion::drive(part, path_.speed_m_s, path_.ramp_s);
      const double from = driven_, from_s = drive_.seconds_;
      add(motion);
      driven_ += motion.amount();
      for (; next_frame_m_ < driven_ - kSame_m; next_frame_m_ += options_.frame_step_m) {
        ++position_id_;
        add_odometry_frames(from_s + motion.time_of(next_frame_m_ - from));
      }
      capture_at_halt();
      if (next_frame_m_ < driven_ + kSame_m) next_frame_m_ += options_.frame_step_m;
      curve = std::move(later);
    }
  }

  void turn_in_place(double angle) {
    const Motion motion = Motion::turn(here_, angle, path_.turn_rate_deg_s * kRadiansPerDegree, path_.ramp_s);
    const double from_s = drive_.seconds_, step = options_.frame_turn_deg * kRadiansPerDegree;
    add(motion);
    for (double due = step; due < std::abs(angle) - 1e-6; due += step) {
      ++position_id_;
      add_odometry_frames(from_s + motion.time_of(due));
    }
    capture_at_halt();
  }

  void pause(double seconds) {
    const double from_s = drive_.seconds_;
    add(Motion::stationary(here_, seconds));
    for (double t = options_.frame_period_s; t <= seconds + 1e-9; t += options_.frame_period_s) {
      ++position_id_;
      add_odometry_frames(from_s + t);
    }
  }

  const PathOptions& path_;
  const CaptureOptions& options_;
  const Rig& rig_;
  Drive drive_;
  PlanarPose here_;
  std::vector<double> stops_;
  double driven_ = 0, next_frame_m_ = options_.frame_step_m;
  std::int64_t position_id_ = -1;
};

Result<Drive> Drive::plan(const PathOptions& path, const CaptureOptions& capture, const Rig& rig) {
  return Planner(path, capture, rig).plan();
}

PlanarPose Drive::at(double time_s) const {
  const auto after = std::upper_bound(segments_.begin(), segments_.end(), time_s,
                                      [](double t, const Segment& segment) { return t < segment.from_s; });
  const Segment& segment = after == segments_.begin() ? segments_.front() : *(after - 1);
  return segment.motion.at(std::clamp(time_s - segment.from_s, 0.0, segment.motion.seconds()));
}

std::vector<PlanarPose> Drive::track() const {
  std::vector<PlanarPose> places;
  for (const Segment& segment : segments_) {
    const double amount = segment.motion.drives() ? segment.motion.amount() : 0;
    const int steps = static_cast<int>(amount / (2 * Motion::kStep_m)) + 1;
    for (int i = 0; i <= steps; ++i) places.push_back(segment.motion.at(segment.motion.time_of(amount * i / steps)));
  }
  return places;
}

}  // namespace spartan::sim
