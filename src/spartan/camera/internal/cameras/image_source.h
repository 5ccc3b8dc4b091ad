// One camera device of a live stream on threads of its own: its images on the clock of the host.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "spartan/camera/internal/cameras/camera_clock.h"
#include "spartan/camera/internal/cameras/camera_device.h"
#include "spartan/camera/internal/cameras/image_pairing.h"
#include "spartan/camera/internal/host_clock.h"
#include "spartan/camera/sample_stream.h"
#include "spartan/core/log.h"
#include "spartan/core/result.h"
#include "spartan/rig/rig.h"

namespace spartan::internal {

/// The device of one camera, or of both of a pair.
struct DeviceRequest {
  std::vector<const Camera*> cameras;  ///< left and right, or one of them; their drivers name the same source
  const CameraDriver& driver() const { return *cameras.front()->driver; }
  std::string names() const;
};

using OpenDevice = std::function<Result<std::unique_ptr<CameraDevice>>(const DeviceRequest&)>;

/// Opens a device, reads it on a thread, and opens it again each kRetry after it was lost. A second thread sends it its
/// exposures and triggers; the times of triggers at a rate are the same for all devices with the same start.
class ImageSource {
 public:
  /// An image of the camera `side` of the request. Called by the thread of the source.
  using Deliver = std::function<void(int side, StampedImage image)>;

  /// Where a device cannot be opened at first. now: that is an error; later: it is tried again and again, as after a
  /// loss.
  enum class Opening { now, later };
  /// Borrows the clock. Errors: those of `open`, with Opening::now.
  static Result<std::unique_ptr<ImageSource>> create(DeviceRequest request, OpenDevice open, const HostClock& clock,
                                                     const Log& log, Opening opening = Opening::now);
  ~ImageSource();
  ImageSource(const ImageSource&) = delete;
  ImageSource& operator=(const ImageSource&) = delete;

  /// Once. `changed` is called where the source has ended.
  void start(std::chrono::steady_clock::time_point first_trigger, Deliver deliver, std::function<void()> changed);
  /// No image will follow.
  bool ended() const { return ended_; }
  /// The camera does not answer now.
  bool is_lost() const;
  bool has_controls() const { return has_controls_; }
  bool waits() const { return waits_; }
  /// They return at once; what the camera refuses is logged. Codes: `read_error` (the camera does not answer now; an
  /// exposure is set when it does), `configuration` (it cannot be controlled).
  /// `number`: of the trigger, the same for both cameras of a pair, from kFirstCommanded on.
  Status trigger(std::int64_t number);
  Status set_exposure(const ExposureSettings& settings);
  /// Of the settings that the device takes, also while it is lost.
  ExposureBounds exposure_bounds() const;
  /// Of a camera of the request. Triggers and losses count for the first one.
  CameraReport camera_report(std::size_t side) const;
  const DeviceRequest& request() const { return request_; }

  static constexpr std::chrono::milliseconds kRetry{1000}, kPoll{50};
  static constexpr std::int64_t kFirstCommanded = std::int64_t{1} << 40;  ///< those by rate count from 0
  static constexpr double kAnswer_s = 1;                                  ///< within which an image follows its trigger

 private:
  ImageSource(DeviceRequest request, OpenDevice open, const HostClock& clock, const Log& log);
  void run();
  void use(std::unique_ptr<CameraDevice> device);
  void reopen();
  Status command(const std::function<void()>& note);
  void run_commands(std::chrono::steady_clock::time_point first_trigger);
  Status send_trigger(CameraDevice& device, std::int64_t number);
  void report(const Status& status);
  void deliver(CameraImage image);
  bool is_new(const CameraImage& image);
  std::int64_t answer_trigger(CameraReport& report, Stamp stamp, Stamp arrival);
  void give_up_triggers();
  StampedImage stamped(CameraImage image);
  void keep_increasing(StampedImage& stamped, const CameraImage& image);
  std::shared_ptr<CameraDevice> device() const;
  bool wait(std::chrono::steady_clock::time_point until);

  DeviceRequest request_;
  OpenDevice open_;
  const HostClock& host_;
  Log log_;
  std::atomic<bool> has_controls_ = false, waits_ = false;  // since it was opened first
  Deliver deliver_;
  std::function<void()> changed_;

  mutable std::mutex mutex_;
  std::condition_variable stop_changed_;
  std::shared_ptr<CameraDevice> device_;  // null: lost
  std::optional<ExposureSettings> exposure_, pending_exposure_;
  ExposureBounds exposure_bounds_;
  std::deque<std::int64_t> pending_triggers_;  // their numbers
  std::array<CameraReport, 2> reports_;        // by side
  struct Trigger {
    std::int64_t number = 0;
    Stamp time;
  };
  std::deque<Trigger> open_triggers_;  // not answered yet
  bool stop_ = false;
  std::atomic<bool> ended_ = false;

  // Of the thread, by side.
  struct Last {
    std::int64_t frame_id = -1, camera_ns = -1;
  };
  std::array<Last, 2> last_;
  std::array<CameraClock, 2> clocks_;
  // The newest trusted stamp.
  struct Mapped {
    std::int64_t camera_ns = 0;
    Stamp stamp;
  };
  std::array<std::optional<Mapped>, 2> mapped_;

  bool refused_ = false;  // of the thread of commands

  std::thread thread_, command_thread_;
};

}  // namespace spartan::internal
