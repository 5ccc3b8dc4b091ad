#include "spartan/sim/drive.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace spartan::sim {
namespace {

constexpr double kRadiansPerDegree = std::numbers::pi / 180;
constexpr double kSettle_s = 0.5;  // at rest before a picture
constexpr double kSame_m = 0.005;  // distances that count as one

}  // namespace

// Lays motion after motion and notes the shots.
class Drive::Planner {
 public:
  Planner(const PathOptions& path, const ShotOptions& options, const Rig& rig)
      : path_(path), options_(options), rig_(rig) {}

  Result<Drive> plan() {
    auto legs = lay_path(path_);
    if (!legs) return failure(legs);
    double length = 0;
    for (const PathLeg& leg : *legs) length += curve_length(leg.curve);
    if (Status s = find_stops(length); !s) return failure(s);
    add(Motion::stand(here_, kRest_s));
    arrive();
    for (const PathLeg& leg : *legs) {
      if (!leg.curve.empty()) {
        drive_along(leg.curve);
      } else if (leg.turn_rad != 0) {
        turn(leg.turn_rad);
      } else {
        rest(leg.rest_s);
      }
    }
    add(Motion::stand(here_, kSettle_s));
    return std::move(drive_);
  }

 private:
  Status find_stops(double length) {
    for (const double at : options_.stops_m) {
      if (at > length + kSame_m) {
        return failure(ErrorCode::configuration,
                       fmt::format("a stop at {} m lies beyond the path's {:.2f} m", at, length), "shots.stops_m");
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
    return std::any_of(stops_.begin(), stops_.end(), [&](double s) { return std::abs(s - metres) < kSame_m; });
  }

  void add(const Motion& motion) {
    drive_.parts_.push_back({drive_.seconds_, motion});
    drive_.seconds_ += motion.seconds();
    here_ = motion.at(motion.seconds());
  }

  // A picture of every pair for odometry, at one position.
  void look(double time_s) {
    for (const StereoPair& pair : rig_.pairs) {
      if (pair.for_odometry) drive_.shots_.push_back({time_s, pair.name, position_, 0, 0});
    }
  }

  // At rest: a picture, and at a stop the pans of the other pairs.
  void arrive() {
    ++position_;
    add(Motion::stand(here_, kSettle_s));
    look(drive_.seconds_);
    if (!is_stop(driven_)) return;
    for (const double pan_deg : options_.pans_deg) {
      add(Motion::stand(here_, options_.seconds_a_pan));
      for (const StereoPair& pair : rig_.pairs) {
        if (!pair.for_odometry)
          drive_.shots_.push_back({drive_.seconds_, pair.name, position_, pan_deg * kRadiansPerDegree, tilt_of(pair)});
      }
    }
    add(Motion::stand(here_, kSettle_s));
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
      const double left = curve_length(curve);
      const auto next = std::find_if(stops_.begin(), stops_.end(), [&](double s) { return s > driven_ + kSame_m; });
      std::vector<PlanarPose> part = curve, rest;
      if (next != stops_.end() && *next < driven_ + left - kSame_m) std::tie(part, rest) = cut(curve, *next - driven_);
      const Motion motion = Motion::drive(part, path_.speed_m_s, path_.ramp_s);
      const double from = driven_, from_s = drive_.seconds_;
      add(motion);
      driven_ += motion.amount();
      for (; next_frame_m_ < driven_ - kSame_m; next_frame_m_ += options_.frame_step_m) {
        ++position_;
        look(from_s + motion.time_of(next_frame_m_ - from));
      }
      arrive();
      if (next_frame_m_ < driven_ + kSame_m) next_frame_m_ += options_.frame_step_m;
      curve = std::move(rest);
    }
  }

  void turn(double angle) {
    const Motion motion = Motion::turn(here_, angle, path_.turn_rate_deg_s * kRadiansPerDegree, path_.ramp_s);
    const double from_s = drive_.seconds_, step = options_.frame_turn_deg * kRadiansPerDegree;
    add(motion);
    for (double due = step; due < std::abs(angle) - 1e-6; due += step) {
      ++position_;
      look(from_s + motion.time_of(due));
    }
    arrive();
  }

  void rest(double seconds) {
    const double from_s = drive_.seconds_;
    add(Motion::stand(here_, seconds));
    for (double t = options_.frame_period_s; t <= seconds + 1e-9; t += options_.frame_period_s) {
      ++position_;
      look(from_s + t);
    }
  }

  const PathOptions& path_;
  const ShotOptions& options_;
  const Rig& rig_;
  Drive drive_;
  PlanarPose here_;
  std::vector<double> stops_;
  double driven_ = 0, next_frame_m_ = options_.frame_step_m;
  std::int64_t position_ = -1;
};

Result<Drive> Drive::plan(const PathOptions& path, const ShotOptions& shots, const Rig& rig) {
  return Planner(path, shots, rig).plan();
}

PlanarPose Drive::at(double time_s) const {
  const auto after = std::upper_bound(parts_.begin(), parts_.end(), time_s,
                                      [](double t, const Part& part) { return t < part.from_s; });
  const Part& part = after == parts_.begin() ? parts_.front() : *(after - 1);
  return part.motion.at(std::clamp(time_s - part.from_s, 0.0, part.motion.seconds()));
}

std::vector<PlanarPose> Drive::track() const {
  std::vector<PlanarPose> places;
  for (const Part& part : parts_) {
    const double amount = part.motion.drives() ? part.motion.amount() : 0;
    const int steps = static_cast<int>(amount / (2 * Motion::kStep_m)) + 1;
    for (int i = 0; i <= steps; ++i) places.push_back(part.motion.at(part.motion.time_of(amount * i / steps)));
  }
  return places;
}

}  // namespace spartan::sim
