// Cameras that run now together with the sensor lines of a FIFO.
#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "spartan/camera/internal/host_clock.h"
#include "spartan/camera/internal/sensor_lines.h"
#include "spartan/camera/sample_stream.h"
#include "spartan/core/files.h"

namespace spartan::internal {

/// Reads the lines of a FIFO on a thread, from its creation on, so that each has the time of its arrival.
class SensorLineReader {
 public:
  /// `clock`: that of the cameras. Codes as Fifo::open().
  static Result<std::unique_ptr<SensorLineReader>> open(const std::string& fifo,
                                                        const Eigen::Quaterniond& body_from_imu,
                                                        const HostClock& clock);
  ~SensorLineReader();
  SensorLineReader(const SensorLineReader&) = delete;
  SensorLineReader& operator=(const SensorLineReader&) = delete;

  std::optional<Sample> take();
  DiscardedSamples discarded() const;

 private:
  SensorLineReader(Fifo fifo, SensorLines lines, const HostClock& clock);
  void run();

  Fifo fifo_;
  HostClock clock_;
  mutable std::mutex mutex_;
  SensorLines lines_;
  std::atomic<bool> ended_ = false;
  std::thread thread_;
};

/// Sensor samples come at most kPoll after their line; the frames of the cameras do not wait for them.
class SensorLineStream : public StreamDecorator {
 public:
  SensorLineStream(std::unique_ptr<SampleStream> cameras, std::unique_ptr<SensorLineReader> lines)
      : StreamDecorator(*cameras), cameras_(std::move(cameras)), lines_(std::move(lines)) {}

  Result<StreamRead> read(std::chrono::nanoseconds timeout) override;
  DiscardedSamples discarded() const override { return lines_->discarded(); }

  static constexpr std::chrono::milliseconds kPoll{2};

 private:
  std::unique_ptr<SampleStream> cameras_;
  std::unique_ptr<SensorLineReader> lines_;
  bool cameras_turn_ = false;
};

}  // namespace spartan::internal
