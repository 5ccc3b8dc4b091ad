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

/// See open_live_simulation(). read() renders, so it may take longer than its timeout.
class LiveSimulation : public SampleStream, public CameraControl {
 public:
  LiveSimulation(SimulationRequest request, double speed, const ThreadPool& workers);

  const StreamInfo& info() const override { return info_; }
  Result<StreamRead> read(std::chrono::nanoseconds timeout) override;
  CameraControl* control() override { return this; }
  void start_after(Stamp stamp) override { start_after_ = stamp; }
  /// The first frame of each pair.
  std::size_t previews(const std::string& pair) const override { return first_frame(pair) ? 1 : 0; }
  Result<StereoFrame> preview(const std::string& pair, std::size_t index) override;

  Status set_exposure(const std::string& pair, const ExposureSettings& settings) override;
  /// The pan-tilt units look there, instead of where the plan of the drive says.
  void set_angles(const PlannedAngles& angles);

  const SimulationRequest& request() const { return *request_; }
  const FrameSimulator& frames() const { return simulator_; }

 private:
  using Clock = std::chrono::steady_clock;
  enum class EventKind { exposure, arrival, imu, wheels, compass, inclinometer, none };
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
  void expose();
  FrameCommands commands_for(const std::string& pair);
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

  std::mutex mutex_;
  std::map<std::string, Exposure> exposures_;
  std::optional<PlannedAngles> angles_;
};

}  // namespace spartan::sim::internal
