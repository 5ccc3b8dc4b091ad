// One or two cameras behind a driver.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "spartan/camera/sample_stream.h"
#include "spartan/core/frame_image.h"
#include "spartan/core/result.h"

namespace spartan::internal {

/// One image as a driver delivers it.
struct CameraImage {
  FrameImage image;             ///< empty: it is not complete
  int side = 0;                 ///< 1: of the second camera of a device with two
  std::int64_t frame_id = -1;   ///< counted by the camera; −1: it does not count
  std::int64_t camera_ns = -1;  ///< stamp of the camera's clock; −1: it has none
  /// When the host received the beginning of it, and when it had all of it.
  std::chrono::steady_clock::time_point began, complete;
  double exposure_us = 0, gain = 0;  ///< 0: unknown
};

/// What read() has found.
struct DeviceRead {
  enum class State {
    image,
    none_yet,  ///< no image came before the timeout
    end,       ///< no image will follow, as after the last one of a file
    lost,      ///< the camera no longer answers; `reason` says why
  };
  State state = State::end;
  CameraImage image;   ///< with State::image
  std::string reason;  ///< with State::lost
};

/// An open device. read() is called by one thread, the others by any.
class CameraDevice {
 public:
  virtual ~CameraDevice() = default;
  virtual DeviceRead read(std::chrono::nanoseconds timeout) = 0;
  /// Whether it can be triggered and its exposure set.
  virtual bool has_controls() const = 0;
  /// A file: images that are not read are not lost.
  virtual bool waits() const { return false; }
  /// Takes one image now. Code `configuration`: it cannot; `read_error`: it does not answer.
  virtual Status trigger() = 0;
  /// Codes as trigger().
  virtual Status set_exposure(const ExposureSettings& settings) = 0;
  /// Of the settings that it takes. Does not wait for the camera.
  virtual ExposureBounds exposure_bounds() const { return {}; }
};

}  // namespace spartan::internal
