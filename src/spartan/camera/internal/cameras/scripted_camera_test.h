// Test fixture of this module: cameras that do what a test tells them to.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <queue>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "spartan/camera/internal/cameras/camera_device.h"
#include "spartan/camera/internal/cameras/camera_stream.h"

namespace spartan::internal {

// What a scripted camera does next, given by the test.
struct Script {
  std::mutex mutex;
  std::queue<DeviceRead> reads;
  std::atomic<int> opened = 0, triggers = 0, exposures = 0;
  std::atomic<bool> openable = true;
  bool waits = false;
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
  bool waits() const override { return script_.waits; }
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

inline Rig two_cameras(const std::string& trigger = CameraDriver::kFree, double rate_hz = 0) {
  Rig rig;
  for (const char* name : {"left", "right"}) {
    Camera camera;
    camera.name = name;
    camera.size = {8, 6};
    camera.driver = CameraDriver{};
    camera.driver->source = std::string("test:") + name;
    camera.driver->trigger = trigger;
    camera.driver->rate_hz = rate_hz;
    rig.cameras.push_back(camera);
  }
  rig.pairs = {{"front", "left", "right", 0, true}};
  return rig;
}

inline DeviceRead image_read(std::int64_t frame_id, int value, ImageSize size = {8, 6}) {
  DeviceRead read{DeviceRead::State::image, {}, {}};
  Image<std::uint8_t> pixels(size.width, size.height, static_cast<std::uint8_t>(value));
  read.image.image = FrameImage::own(std::move(pixels), PixelFormat());
  read.image.frame_id = frame_id;
  read.image.began = read.image.complete = std::chrono::steady_clock::now();
  read.image.camera_ns = read.image.began.time_since_epoch() / std::chrono::nanoseconds(1);
  return read;
}

class CameraStreamTest : public ::testing::Test {
 protected:
  void deliver(std::int64_t id) {
    const DeviceRead left = image_read(id, 1);
    DeviceRead right = image_read(id, 2);
    right.image.began = left.image.began;  // however busy this computer is
    right.image.complete = left.image.complete;
    right.image.camera_ns = left.image.camera_ns;
    left_script.add(left);
    right_script.add(right);
  }

  Result<std::unique_ptr<CameraStream>> open(const Rig& rig) {
    StreamInfo info;
    info.rig = rig;
    info.path = "test:";
    CameraStreamOptions options;
    options.pair_wait = pair_wait;
    options.first_wait = first_wait;
    options.should_stop = should_stop;
    return CameraStream::create(
        info,
        [this](const DeviceRequest& request) -> Result<std::unique_ptr<CameraDevice>> {
          Script& script = scripts[request.cameras.front()->name];
          if (!script.openable) return failure(ErrorCode::read_error, "is not there", request.names());
          return std::make_unique<ScriptedCamera>(script);
        },
        options, Log::to_function([this](LogLevel, std::string_view text) {
          const std::lock_guard lock(said_mutex_);
          said_.emplace_back(text);
        }));
  }

  // What the threads of the streams have logged since the last call.
  std::vector<std::string> take_said() {
    const std::lock_guard lock(said_mutex_);
    return std::exchange(said_, {});
  }

  // While images come, of which a busy computer notices some pairs too far apart.
  Result<std::unique_ptr<CameraStream>> open_while_delivering(const Rig& rig) {
    std::atomic<bool> opened = false;
    std::thread cameras([&] {
      for (std::int64_t id = 1; !opened; ++id) {
        deliver(id);
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
      }
    });
    auto stream = open(rig);
    opened = true;
    cameras.join();
    return stream;
  }

  // The next sample, waited for.
  static Sample next(CameraStream& stream) {
    auto read = stream.read(std::chrono::seconds(20));
    EXPECT_TRUE(read && read->state == StreamRead::State::sample);
    return read && read->sample ? *read->sample : Sample(ImuSample());
  }

  std::map<std::string, Script> scripts;
  Script &left_script = scripts["left"], &right_script = scripts["right"];
  std::chrono::milliseconds first_wait{500}, pair_wait{100};
  std::function<bool()> should_stop;

 private:
  std::mutex said_mutex_;
  std::vector<std::string> said_;
};

}  // namespace spartan::internal
