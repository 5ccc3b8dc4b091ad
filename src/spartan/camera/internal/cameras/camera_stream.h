// Cameras that run now, as a stream of stereo frames.
#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "spartan/camera/internal/cameras/image_pairing.h"
#include "spartan/camera/internal/cameras/image_source.h"
#include "spartan/camera/sample_stream.h"
#include "spartan/core/log.h"

namespace spartan::internal {

struct CameraStreamOptions {
  double pair_tolerance_s = 0.005;              ///< as in OpenOptions
  std::chrono::milliseconds pair_wait{200};     ///< for the other image of a pair, and for that of a trigger
  std::chrono::milliseconds first_wait{10000};  ///< for the first frame of each pair
  HostClock clock{};                            ///< of the stamps
  std::function<bool()> should_stop{};          ///< asked while the first frames are waited for; empty: never
};

/// The pairs of a rig whose cameras have drivers. An image without a partner, and a trigger without an image, come as
/// MissingFrame with the reason; of files, whose images wait, only where a partner can no longer come. Ends where all
/// devices have ended; a device that is lost is opened again and again.
class CameraStream : public SampleStream, public CameraControl {
 public:
  /// Waits for the first frame of each pair, which is its preview. A pair that is not for the odometry has none, with a
  /// message, where it delivers no frame or a camera of it cannot be opened, which is tried again and again. Codes:
  /// `configuration` (no pair has drivers, or those of a pair do not fit), `read_error` (a camera does not answer, or
  /// delivers no image), `interrupted`, and those of `open`.
  static Result<std::unique_ptr<CameraStream>> create(const StreamInfo& info, const OpenDevice& open,
                                                      const CameraStreamOptions& options, const Log& log);
  ~CameraStream() override;
  CameraStream(const CameraStream&) = delete;
  CameraStream& operator=(const CameraStream&) = delete;

  const StreamInfo& info() const override { return info_; }
  /// Begins with the first frame after the first call; of files with the first one.
  Result<StreamRead> read(std::chrono::nanoseconds timeout) override;
  /// Null where no camera can be controlled.
  CameraControl* control() override;
  Status set_exposure(const std::string& pair, const ExposureSettings& settings) override;
  ExposureBounds exposure_bounds(const std::string& pair) const override;
  Status trigger(const std::string& pair) override;
  std::size_t previews(const std::string& pair) const override { return previews_.count(pair); }
  Result<StereoFrame> preview(const std::string& pair, std::size_t index) override;
  std::vector<CameraPairReport> camera_reports() const override;

  static constexpr std::size_t kMostWaiting = 16;  ///< images of a camera that no call of read() has taken
  static constexpr std::size_t kMostAhead = 64;  ///< of a file with the images of both cameras, where one has none yet

 private:
  // The devices of a pair and what they have delivered.
  struct Feed {
    explicit Feed(const CameraStreamOptions& options) : pairing(options.pair_tolerance_s, options.pair_wait) {}
    StereoPair pair;
    bool waits = false;  // as the first source
    ImagePairing pairing;
    std::array<std::chrono::steady_clock::time_point, 2> newest;  // images, by side
    std::array<int, 2> behind{};  // images of the other side since the newest one of this side
    std::optional<Stamp> last_stamp;
    CameraPairReport report;
    double skew_sum_ms = 0;
    std::vector<std::unique_ptr<ImageSource>> sources;  // last: their threads, which use the others, end first
  };

  CameraStream(const StreamInfo& info, const CameraStreamOptions& options, const Log& log);
  Status open_pair(const StereoPair& pair, const OpenDevice& open);
  void start();
  void add(Feed& feed, int side, StampedImage image);
  static bool has_room(const Feed& feed, int side);
  static bool lacks_partners(const Feed& feed);
  static bool is_one_camera_silent(Feed& feed, std::chrono::steady_clock::time_point now);
  void take_all(std::chrono::steady_clock::time_point now);
  void take_pair(Feed& feed, const ImagePair& pair);
  Sample sample_of(Feed& feed, const ImagePair& pair);
  StereoFrame frame_of(const Feed& feed, const ImagePair& pair) const;
  // Why a frame cannot be delivered, and the count of such frames.
  struct Fault {
    FrameFault kind;
    std::string message;
    std::int64_t CameraPairReport::*count;
  };
  std::optional<Fault> fault_of(const Feed& feed, const ImagePair& pair, const StereoFrame& frame) const;
  std::string why_missing(const Feed& feed, std::size_t side) const;
  void push(Sample sample, std::chrono::steady_clock::time_point arrived);
  Status wait_for_previews();
  /// `fault`: of the last frame that could not be delivered; null: there was none.
  tl::unexpected<Error> no_preview(const Feed& feed, const Fault* fault) const;
  Status report_silent_pairs() const;
  bool all_ended() const;
  bool waits() const;
  std::chrono::steady_clock::time_point next_timeout(std::chrono::steady_clock::time_point latest) const;
  Result<Feed*> feed_of(const std::string& pair);

  StreamInfo info_;
  CameraStreamOptions options_;
  Log log_;
  HostClock clock_;
  std::map<std::string, StereoFrame> previews_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool reading_ = false, closing_ = false;
  std::int64_t next_frame_id_ = 0, next_trigger_ = ImageSource::kFirstCommanded;
  std::deque<StreamRead> samples_;
  std::vector<std::unique_ptr<Feed>> feeds_;  // last: their threads end first
};

}  // namespace spartan::internal
