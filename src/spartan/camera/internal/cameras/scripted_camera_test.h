// Test fixture of this module: a camera that does what a test tells it to.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <queue>
#include <string>
#include <thread>
#include <utility>

#include "spartan/camera/internal/cameras/camera_device.h"

namespace spartan::internal {

// What a scripted camera does next, given by the test.
struct Script {
  std::mutex mutex;
  std::queue<DeviceRead> reads;
  std::atomic<int> opened = 0, triggers = 0, exposures = 0;
  std::atomic<bool> openable = true;
  ExposureBounds bounds;

  void add(DeviceRead read) {
    const std::lock_guard lock(mutex);
    reads.push(std::move(read));
  }
};

class ScriptedCamera : public CameraDevice {
 public:
  explicit ScriptedCamera(Script& script) : script_(script) { ++script.opened; }
  DeviceRead read(std::chrono::nanoseconds) override {
    {
      const std::lock_guard lock(script_.mutex);
      if (!script_.reads.empty()) {
        DeviceRead read = std::move(script_.reads.front());
        script_.reads.pop();
        return read;
      }
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return {DeviceRead::State::none_yet, {}, {}};
  }
  bool has_controls() const override { return true; }
  Status trigger() override {
    ++script_.triggers;
    return {};
  }
  Status set_exposure(const ExposureSettings& settings) override {
    EXPECT_EQ(settings.exposure_us, 2000);
    ++script_.exposures;
    return {};
  }
  ExposureBounds exposure_bounds() const override { return script_.bounds; }

 private:
  Script& script_;
};

}  // namespace spartan::internal
