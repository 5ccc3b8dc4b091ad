// Cameras that run now together with the sensor lines of a FIFO.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "spartan/camera/internal/host_clock.h"
#include "spartan/camera/internal/sensor_lines.h"
#include "spartan/camera/stream_decorator.h"
#include "spartan/core/fifo.h"

namespace spartan::internal {

/// Sensor samples come at most kPoll after their line; the frames of the cameras do not wait for them.
class SensorLineStream : public StreamDecorator {
 public:
  /// Codes as Fifo::open().
  static Result<std::unique_ptr<SampleStream>> open(std::unique_ptr<SampleStream> cameras, const std::string& fifo);

  Result<StreamRead> read(std::chrono::nanoseconds timeout) override;
  DiscardedSamples discarded() const override { return lines_.discarded(); }

  static constexpr std::chrono::milliseconds kPoll{2};

 private:
  SensorLineStream(std::unique_ptr<SampleStream> cameras, Fifo fifo, const std::string& name);
  void receive();

  std::unique_ptr<SampleStream> cameras_;
  Fifo fifo_;
  HostClock clock_;
  SensorLines lines_;
};

}  // namespace spartan::internal
