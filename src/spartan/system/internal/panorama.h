// Panoramas of a live run: the pan-tilt unit turns, and each of its pairs takes a frame at each angle.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
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
/// still, and takes the frames; what goes wrong with one angle is logged, and the next one follows. At the end the unit
/// returns to rest, as it does first of all where it is not there. Until it has returned no panorama begins, and the
/// odometry's pair has no frames where it is on the unit, too; where it is not, kAttempts that fail are enough. A stop
/// has a frame of the odometry's pair: where that is on the unit, the unit begins to move after one.
class Panorama {
 public:
  using Clock = std::chrono::steady_clock;

  /// `unit` and `cameras` (null: they take frames by themselves) are borrowed. The odometry's pair takes no views:
  /// where it is on the unit, too, it has frames at the rest angles only. Code `configuration`: no
  /// other pair of the rig is on its pan-tilt unit.
  static Result<std::unique_ptr<Panorama>> create(const Rig& rig, const std::string& odometry_pair,
                                                  const PanoramaOptions& options, PanTiltControl& unit,
                                                  CameraControl* cameras, const RunHooks& hooks);
  /// Ends a panorama that has begun.
  ~Panorama();
  Panorama(const Panorama&) = delete;
  Panorama& operator=(const Panorama&) = delete;

  void request();
  /// For the exposure: the newest frame of each pair of the unit that is no view, from between panoramas or from the
  /// first angles of one. From the first call on a panorama begins with kMetered frames for `measure` alone; in the
  /// thread of add().
  void meter(const std::function<void(const StereoFrame&)>& measure);
  /// Each frame of the odometry and each sample of these sensors, in one thread.
  template <class Motion>
  void add(const Motion& motion) {
    check_.add(motion);
    if constexpr (std::is_same_v<Motion, RoverMotion>) distance_m_ = motion.distance_m;
    update(motion.stamp);
  }
  /// Gives a frame its stop, and one of the unit's cameras its angles. False: it was not taken for a panorama, while
  /// the unit moved, or, of the odometry's pair, since the unit has left its rest; one image is no view. Frames stay as
  /// they are until the unit is first moved, where panoramas are taken by request() alone: the stream may have moved
  /// its cameras.
  bool label(StereoFrame& frame);

  static constexpr int kAttempts = 3;        ///< of a motion, and of a frame
  static constexpr int kMetered = 2;         ///< frames of each pair
  static constexpr double kPatience_s = 10;  ///< then it is logged why a panorama has not begun

 private:
  enum class Phase { idle, beginning, moving, taking, returning };

  Panorama(const Rig& rig, const std::string& odometry_pair, const PanoramaOptions& options, PanTiltControl& unit,
           CameraControl* cameras, const RunHooks& hooks);
  void update(Stamp stamp);
  void explain_waiting(Stamp stamp, StationaryCheck::State state);
  bool is_at_rest();
  void run();
  void report(bool begins);
  bool begin_stop();
  void take_all();
  void return_to_rest();
  bool look_at(const PanTiltAngles& angles);
  Result<PanTiltReading> settle(const PanTiltAngles& angles);
  void meter_exposure(const PanTiltAngles& angles);
  void take_frames(const PanTiltAngles& angles);
  void trigger(const std::set<std::string>& pairs);
  void set_phase(Phase phase);
  bool wait(std::chrono::duration<double> time);
  /// Whether all are there, or the panorama ends.
  bool wait_for_frames();
  bool wait_in_stream(const std::function<bool()>& done);
  bool ends() const { return ended_ || (rover_moved_ && phase_ != Phase::returning); }

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
  bool untouched_ = false;  // the unit has not been moved, and the stream's frames are not changed
  bool requested_ = false, wanted_ = false, rover_moved_ = false, ended_ = false;
  std::optional<Stamp> waits_since_;  // for the rover to be stationary
  bool explained_ = false;
  double next_at_m_ = 0;
  std::int64_t position_id_ = -1;
  PanTiltAngles angles_;
  std::set<std::string> missing_;              // pairs without a frame at these angles, or at the begin
  std::set<std::string> unmetered_;            // pairs whose exposure is not set for these angles
  std::map<std::string, StereoFrame> unused_;  // for meter(), by pair
  bool metered_ = false;                       // meter() is called
  int views_ = 0;
  Stamp latest_;  // of all frames and sensor samples
  std::thread thread_;
};

/// A stream whose frames are labelled by a Panorama; those that it does not want are left out, the single image of a
/// MissingFrame, too. Both are borrowed.
class PanoramaStream : public StreamDecorator {
 public:
  PanoramaStream(SampleStream& stream, Panorama& panorama) : StreamDecorator(stream), panorama_(panorama) {}

  Result<StreamRead> read(std::chrono::nanoseconds timeout) override;

 private:
  Panorama& panorama_;
};

}  // namespace spartan::internal
