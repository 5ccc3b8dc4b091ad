// Whether the rover stands still.
#pragma once

#include <Eigen/Core>
#include <deque>
#include <optional>

#include "spartan/camera/samples.h"
#include "spartan/core/pose.h"
#include "spartan/core/time.h"

namespace spartan::internal {

/// How the rover moves at a frame of the odometry.
struct RoverMotion {
  Stamp stamp;
  double distance_m = 0;                 ///< path length so far
  Vector6d velocity = Vector6d::Zero();  ///< Pipeline::body_velocity()
};

/// Whether the rover is stationary, by frames of the odometry, wheels and gyroscope: none has shown a motion for
/// kStill_s, and frames or wheels would have shown one. The gyroscope, whose bias is not known, shows one where its
/// rates differ from their mean; a turn at a constant rate is shown by frames or wheels.
class StationaryCheck {
 public:
  enum class State {
    stationary,
    unknown,  ///< neither frames nor wheels show a speed
    moves,    ///< frames or wheels show a motion
    shaken,   ///< the gyroscope alone shows one
  };
  void add(const RoverMotion& motion);
  void add(const WheelSample& sample);
  void add(const ImuSample& sample);
  State state() const;
  bool is_stationary() const { return state() == State::stationary; }
  /// A motion that is not noise.
  bool drives() const { return drives_; }

  static constexpr double kStill_s = 0.5;

 private:
  void note(Stamp stamp, bool moves, bool drives);
  Eigen::Vector3d mean_rate() const;
  bool gyro_varies() const;

  std::deque<WheelSample> wheels_;  // of the last kStill_s
  std::deque<ImuSample> gyro_;
  std::optional<Stamp> newest_, speed_at_;  // of all samples; of those that show a speed
  std::optional<Stamp> moved_at_;           // the newest that shows a motion, or the first of all
  std::optional<Stamp> frame_at_;
  bool drives_ = false;
};

}  // namespace spartan::internal
