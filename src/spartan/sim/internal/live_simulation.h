// A simulated drive as a live stream.
#pragma once

#include <chrono>
#include <cstddef>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "spartan/camera/sample_stream.h"
#include "spartan/core/threads.h"
#include "spartan/sim/internal/frame_simulator.h"
#include "spartan/sim/simulator.h"

namespace spartan::sim::internal {

/// See open_live_simulation(). read() renders, so it may take longer than its timeout. From the first command of the
/// pan-tilt unit on, its cameras take only frames that are triggered; those of the odometry go on.
class LiveSimulation : public SampleStream, public CameraControl, public PanTiltControl {
 public:
  LiveSimulation(SimulationRequest request, double speed, const ThreadPool& workers);

  const StreamInfo& info() const override { return info_; }
  Result<StreamRead> read(std::chrono::nanoseconds timeout) override;
  CameraControl* control() override { return this; }
  /// Null where no camera of the rig is on a pan-tilt unit.
  PanTiltControl* pan_tilt() override;
  bool is_repeatable() const override { return true; }
  void start_after(Stamp stamp) override { start_after_ = stamp; }
  /// The first frame of each pair.
  std::size_t previews(const std::string& pair) const override { return first_frame(pair) ? 1 : 0; }
  Result<StereoFrame> preview(const std::string& pair, std::size_t index) override;

  Status set_exposure(const std::string& pair, const ExposureSettings& settings) override;
  Status trigger(const std::string& pair) override;
  Status move_to(const PanTiltAngles& angles) override;
  Result<PanTiltReading> read() override;
  double sigma_rad() const override { return 0; }
  /// The unit is there at once, as another one is that moves in its place.
  void set_angles(const PanTiltAngles& angles);

  static constexpr double kPanTiltRate_rad_s = 0.5;

  const SimulationRequest& request() const { return *request_; }
  const FrameSimulator& frames() const { return simulator_; }

 private:
  using Clock = std::chrono::steady_clock;
  enum class EventKind { exposure, trigger, arrival, imu, wheels, compass, inclinometer, none };
  struct Event {
    Stamp stamp;  // of the drive's clock
    EventKind kind = EventKind::none;
  };
  struct Arrival {
    Stamp stamp;
    StereoFrame frame;
  };

  std::optional<std::size_t> first_frame(const std::string& pair) const;
  void begin();
  Event next_event() const;
  bool wait_for(Stamp stamp, Clock::time_point until);
  void expose_planned();
  void expose_triggered();
  void expose(std::size_t frame, const FrameFaultState& fault, const FrameCommands& commands);
  FrameCommands commands_for(const std::string& pair, double time_s);
  bool is_on_mast(const std::string& pair) const;
  Stamp now() const;
  PanTiltAngles angles_at(Stamp stamp) const;
  Sample take(EventKind kind);

  std::unique_ptr<const SimulationRequest> request_;
  double speed_;
  ThreadPool workers_;
  FrameSimulator simulator_;
  StreamInfo info_;
  std::vector<ImuSample> imu_;
  std::vector<WheelSample> wheels_;
  std::vector<CompassSample> compass_;
  std::vector<InclinometerSample> inclinometer_;
  // Of the next samples.
  std::size_t frame_ = 0, imu_index_ = 0, wheel_index_ = 0, compass_index_ = 0, inclinometer_index_ = 0;
  std::deque<Arrival> arrivals_;
  std::optional<Stamp> start_after_;
  std::optional<Clock::time_point> start_;
  Stamp start_stamp_;  // when it has begun
  std::size_t triggered_number_ = 0;

  // What is set and read by other threads, too.
  mutable std::mutex mutex_;
  std::optional<Clock::time_point> still_since_;  // while an image is rendered
  Stamp newest_;                                  // of an event
  std::map<std::string, Exposure> exposures_;
  struct Motion {
    PanTiltAngles from, to;
    Stamp begin;
  };
  std::optional<Motion> motion_;
  struct Trigger {
    std::string pair;
    Stamp stamp;
  };
  std::deque<Trigger> triggers_;
};

}  // namespace spartan::sim::internal
