// Panoramas of a live run: the pan-tilt unit turns, and each of its pairs takes a frame at each angle.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <type_traits>
#include <vector>

#include "spartan/camera/sample_stream.h"
#include "spartan/core/log.h"
#include "spartan/rig/rig.h"
#include "spartan/system/internal/stationary_check.h"
#include "spartan/system/run.h"
#include "spartan/system/run_options.h"

namespace spartan::internal {

/// A panorama begins when it was requested, or the rover has driven PanoramaOptions::every_m since the last one, and as
/// soon as the rover is stationary; it ends early where the rover drives on. A thread moves the unit, waits until it is
/// still, and takes the frames; what goes wrong with one angle is logged, and the next one follows.
class Panorama {
 public:
  using Clock = std::chrono::steady_clock;

  /// `unit` and `cameras` (null: they take frames by themselves) are borrowed. The odometry takes no part in a
  /// panorama: where its pair is on the unit, too, it has frames at the rest angles only. Code `configuration`: no
  /// other pair of the rig is on its pan-tilt unit.
  static Result<std::unique_ptr<Panorama>> create(const Rig& rig, const std::string& odometry_pair,
                                                  const PanoramaOptions& options, PanTiltControl& unit,
                                                  CameraControl* cameras, const RunHooks& hooks);
  /// Ends a panorama that has begun.
  ~Panorama();
  Panorama(const Panorama&) = delete;
  Panorama& operator=(const Panorama&) = delete;

  void request();
  /// Each frame of the odometry and each sample of these sensors, in one thread.
  template <class Motion>
  void add(const Motion& motion) {
    check_.add(motion);
    if constexpr (std::is_same_v<Motion, RoverMotion>) distance_m_ = motion.distance_m;
    update(motion.stamp);
  }
  /// Gives a frame its stop, and one of the unit's cameras its angles. False: it was not taken for a panorama, while
  /// the unit moved, or, of the odometry's pair, during a panorama.
  bool label(StereoFrame& frame);

 private:
  enum class Phase { idle, moving, taking };

  Panorama(const Rig& rig, const std::string& odometry_pair, const PanoramaOptions& options, PanTiltControl& unit,
           CameraControl* cameras, const RunHooks& hooks);
  void update(Stamp stamp);
  void run();
  void report(bool begins);
  void take_all();
  bool look_at(const PanTiltAngles& angles);
  Result<PanTiltReading> settle(const PanTiltAngles& angles);
  void take_frames(const PanTiltAngles& angles);
  void set_phase(Phase phase);
  bool wait(std::chrono::duration<double> time);
  /// Whether all are there, or the panorama ends.
  bool wait_for_frames();
  bool wait_in_stream(const std::function<bool()>& done);
  bool ends() const { return ended_ || rover_moved_; }

  PanoramaOptions options_;
  PanTiltControl& unit_;
  CameraControl* cameras_;
  RunHooks hooks_;
  PanTiltAngles rest_;
  std::set<std::string> pairs_;  // on the unit, without the odometry's
  std::string odometry_pair_;    // where it is on the unit
  StationaryCheck check_;
  double distance_m_ = 0;

  std::mutex mutex_;
  std::condition_variable changed_;
  Phase phase_ = Phase::idle;
  bool requested_ = false, wanted_ = false, rover_moved_ = false, ended_ = false;
  double next_at_m_ = 0;
  std::int64_t position_id_ = -1;
  PanTiltAngles angles_;
  std::set<std::string> missing_;  // pairs without a frame at these angles
  int views_ = 0;
  Stamp latest_;  // of all frames and sensor samples
  std::thread thread_;
};

/// A stream whose frames are labelled by a Panorama; those that it does not want are left out. Both are borrowed.
class PanoramaStream : public StreamDecorator {
 public:
  PanoramaStream(SampleStream& stream, Panorama& panorama) : StreamDecorator(stream), panorama_(panorama) {}

  Result<StreamRead> read(std::chrono::nanoseconds timeout) override;

 private:
  Panorama& panorama_;
};

}  // namespace spartan::internal
