// SampleStream: stereo frames and sensor samples in order of arrival, from a recording or from sensors that run now,
// and control of these sensors.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spartan/camera/samples.h"
#include "spartan/core/log.h"
#include "spartan/core/result.h"
#include "spartan/rig/rig.h"

namespace spartan {

struct OpenOptions;

/// What a stream states about the rover that its samples come from.
struct StreamInfo {
  std::string path;  ///< folder of a recording; address of a live stream
  Rig rig;
  std::string rig_source;              ///< the file that the rig was read from
  std::string name;                    ///< from recording.yaml, else the folder's name
  std::string description;             ///< from recording.yaml, else empty
  std::optional<double> gravity_m_s2;  ///< from recording.yaml
  SensorNoise noise;                   ///< specified noise, from recording.yaml or imu0/sensor.yaml
  bool has_imu = false;

  /// The folder of the rig's file, to which the names of its self-masks are relative.
  std::string mask_folder() const;
};

/// Sensor samples (not frames) that a stream has discarded so far.
struct DiscardedSamples {
  std::int64_t reversed = 0;     ///< their stamps do not increase within their sensor
  std::int64_t unreadable = 0;   ///< they cannot be parsed
  std::string first_unreadable;  ///< place and fault of the first one
};

/// One line of a log for each kind that is not zero.
std::vector<std::string> describe(const DiscardedSamples& discarded);

/// Outcome of SampleStream::read().
struct StreamRead {
  enum class State {
    sample,
    none_yet,  ///< no sample arrived before the timeout
    end,       ///< no sample will follow
  };
  State state = State::end;
  std::optional<Sample> sample;                   ///< with State::sample
  std::chrono::steady_clock::time_point arrived;  ///< when the host had the sample complete
};

/// What one camera of a live stream has delivered so far.
struct CameraReport {
  std::string camera;
  std::int64_t images = 0;                    ///< complete ones
  std::int64_t incomplete = 0;                ///< packets of them were lost
  std::int64_t not_received = 0;              ///< left out in the count of the camera
  std::int64_t duplicates = 0, reversed = 0;  ///< discarded: the same image again; one from before
  std::int64_t wrong_stamps = 0;              ///< the time of the image was taken from its arrival
  std::int64_t triggers = 0;                  ///< sent by software
  std::int64_t unanswered = 0;                ///< triggers without an image
  std::int64_t untriggered = 0;               ///< images without a trigger, or long after it, of a triggered camera
  std::int64_t losses = 0;                    ///< how often it no longer answered
  double clock_sigma_ms = 0;                  ///< standard deviation of the newest stamp on the clock of the host
  double clock_rate_ppm = 0;                  ///< by how much the host's clock is faster than that of the camera
};

/// What the cameras of a pair have delivered together since the first call of SampleStream::read().
struct CameraPairReport {
  std::string pair;
  std::int64_t pairs = 0;                        ///< frames with both images
  std::int64_t left_alone = 0, right_alone = 0;  ///< images without one of the other camera
  std::int64_t incomplete = 0;                   ///< frames with an image that is not complete
  std::int64_t apart = 0;                        ///< frames whose images answer one trigger at different times
  std::int64_t wrong_size = 0, stamps_reversed = 0, not_taken = 0;  ///< frames; images that waited for too long
  double mean_skew_ms = 0, largest_skew_ms = 0;                     ///< stamp of the right image minus the left one
  std::vector<CameraReport> cameras;                                ///< left, right
};

/// One line of a log: what was delivered, and everything else that is not zero.
std::string describe(const CameraPairReport& report);

/// Exposure of an image.
struct ExposureSettings {
  double exposure_us = 0;  ///< µs; duration
  double gain = 1;         ///< at least 1
};

/// The settings that cameras take.
struct ExposureBounds {
  double shortest_us = 0, longest_us = std::numeric_limits<double>::infinity();
  double smallest_gain = 0, largest_gain = std::numeric_limits<double>::infinity();
};

/// The part of `wanted` that is possible; where no part is, the possible settings that are nearest.
ExposureBounds limit(const ExposureBounds& wanted, const ExposureBounds& possible);

/// Settings of cameras that run now. A setting applies to images whose exposure begins after the call, or to later
/// ones; frames state what they were taken with, as far as it is known. Can be called while another thread reads the
/// stream.
class CameraControl {
 public:
  virtual ~CameraControl() = default;
  /// Of both cameras of a pair.
  virtual Status set_exposure(const std::string& pair, const ExposureSettings& settings) = 0;
  /// Settings beyond them are refused, by one of the cameras of a pair at least.
  virtual ExposureBounds exposure_bounds(const std::string& /*pair*/) const { return {}; }
  /// Takes one frame now, beside those that the cameras take by themselves. Code `configuration`: they cannot.
  virtual Status trigger(const std::string& pair) = 0;
};

/// As in the rig: pan positive to the left, tilt positive downwards.
struct PanTiltAngles {
  double pan_rad = 0, tilt_rad = 0;
};

/// Where a pan-tilt unit is.
struct PanTiltReading {
  PanTiltAngles angles;
  bool moves = false;  ///< it is not yet where move_to() has sent it
};

/// A pan-tilt unit that runs now.
class PanTiltControl {
 public:
  virtual ~PanTiltControl() = default;
  /// Begins a motion; it need not have ended before the next one begins. Codes: `input` (beyond the limits of the
  /// unit), `read_error` (the unit does not answer, or refuses).
  virtual Status move_to(const PanTiltAngles& angles) = 0;
  /// Code `read_error`: the unit does not answer, or it no longer goes where it was sent, as after a loss of power.
  /// move_to() may be tried again.
  virtual Result<PanTiltReading> read() = 0;
  /// Standard deviation of the angles of a unit that has ended its motion, rad.
  virtual double sigma_rad() const = 0;
};

/// Opens `flir:DEVICE`, a unit by FLIR or Directed Perception with their ASCII protocol at a serial line, 9600 baud;
/// `flir:DEVICE?baud=115200&pan=1&tilt=1&pan_deg_s=30&tilt_deg_s=15`: another rate, axes that count to the other side
/// (positions count to the right and upwards by default), speeds in degrees per second (by default those of the unit).
/// Codes: `usage` (no such address, or a speed beyond the limits of the unit), `read_error` (no such device, or it does
/// not answer).
Result<std::unique_ptr<PanTiltControl>> open_pan_tilt(const std::string& address);

/// Samples in order of arrival. A recording yields them ordered by stamp; from a live stream they arrive late and out
/// of order between sensors, in order within each.
class SampleStream {
 public:
  virtual ~SampleStream() = default;

  virtual const StreamInfo& info() const = 0;

  /// The next sample, waiting for it at most `timeout`. A frame that cannot be delivered comes as MissingFrame. Codes:
  /// `read_error` and `resources` where the system cannot read now; of other errors the stream does not recover.
  virtual Result<StreamRead> read(std::chrono::nanoseconds timeout) = 0;

  virtual DiscardedSamples discarded() const { return {}; }

  /// Of the pairs whose cameras run now. Can be called while another thread reads the stream.
  virtual std::vector<CameraPairReport> camera_reports() const { return {}; }

  /// Null where the cameras cannot be controlled. Borrowed.
  virtual CameraControl* control() { return nullptr; }
  /// The pan-tilt unit behind the stream; null where there is none. Borrowed.
  virtual PanTiltControl* pan_tilt() { return nullptr; }

  /// Whether the same samples come again in another run, as those of a recording. Then start_after() has an effect.
  virtual bool is_repeatable() const { return false; }
  /// Before the first call of read(): it begins after this stamp.
  virtual void start_after(Stamp /*stamp*/) {}

  /// Number of frames of a pair that can be had before the first call of read(), for what is chosen by images: all
  /// listed ones of a recording, those that a camera takes for this purpose.
  virtual std::size_t previews(const std::string& pair) const = 0;
  /// One of them, in order of time. Does not change what read() returns. Code `input`: this one is not usable.
  virtual Result<StereoFrame> preview(const std::string& pair, std::size_t index) = 0;
};

/// Base of streams that change the samples of another one: all but read() is that of the stream behind it, which is
/// borrowed.
class StreamDecorator : public SampleStream {
 public:
  explicit StreamDecorator(SampleStream& behind) : behind_(behind) {}

  const StreamInfo& info() const override { return behind_.info(); }
  DiscardedSamples discarded() const override { return behind_.discarded(); }
  std::vector<CameraPairReport> camera_reports() const override { return behind_.camera_reports(); }
  CameraControl* control() override { return behind_.control(); }
  PanTiltControl* pan_tilt() override { return behind_.pan_tilt(); }
  bool is_repeatable() const override { return behind_.is_repeatable(); }
  void start_after(Stamp stamp) override { behind_.start_after(stamp); }
  std::size_t previews(const std::string& pair) const override { return behind_.previews(pair); }
  Result<StereoFrame> preview(const std::string& pair, std::size_t index) override {
    return behind_.preview(pair, index);
  }

 protected:
  SampleStream& behind() { return behind_; }
  const SampleStream& behind() const { return behind_; }

 private:
  SampleStream& behind_;
};

/// How to open a live stream.
struct LiveOptions {
  double speed = 1;  ///< of a stream that is not real: seconds of its stamps in a second
  int passes = 1;    ///< how often a recording is played
  Log log = {};      ///< of cameras that are lost and found again
  /// Of cameras: path of a FIFO, created if there is none, from which samples of the other sensors are read
  /// (docs/reference/recording.md, sensor lines); empty: there are none.
  std::string sensors = {};
  std::function<bool()> should_stop = {};  ///< asked while cameras are waited for; empty: never
};

/// Whether an input is the address of a live stream ("replay:FOLDER") and not the folder of a recording.
bool is_live_address(std::string_view input);

/// Opens a live stream:
/// - `replay:FOLDER`: a recording whose samples arrive at the pace of their stamps;
/// - `live:RIG`: the cameras that have a driver in a rig file;
/// - `aravis:LEFT,RIGHT`: two GenICam cameras (GigE Vision, USB3 Vision) by their ids or addresses, `gst:PIPELINE`: a
///   pipeline of GStreamer with a side-by-side image or two sinks `left` and `right`; for the odometry's pair of
///   OpenOptions::rig_file, with what the drivers of its cameras state besides.
///
/// Codes: `usage` (no such kind of stream, speed or passes not positive, `sensors` of a replay, `rig_file` beside
/// `live:RIG`), `output` (the FIFO), `configuration` (drivers, or no plugin for them), `read_error` (cameras), and
/// those of open_recording(), read_rig_yaml() and read_rig().
Result<std::unique_ptr<SampleStream>> open_live_stream(const std::string& address, const OpenOptions& open,
                                                       const LiveOptions& options);

}  // namespace spartan
