// Recording: the stereo frames and sensor samples of a recording, whatever its folder layout.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "spartan/camera/sample_stream.h"
#include "spartan/camera/samples.h"
#include "spartan/core/frame_image.h"
#include "spartan/core/result.h"
#include "spartan/rig/rig.h"

namespace spartan {

enum class RecordingFormat { spartan, kitti, kitti_raw, euroc, images, video };

/// The name that --format takes: "spartan", "kitti", "kitti-raw", "euroc", "images" or
/// "video".
std::string_view name_of(RecordingFormat format);
/// The format with that name. Code `usage` where there is none.
Result<RecordingFormat> parse_recording_format(std::string_view name);

/// Completeness and time order of the listed frames, computed when the recording is opened.
struct SequenceReport {
  int announced = 0;      ///< stereo frames listed by the recording, over all pairs
  int orphans_left = 0;   ///< left images without a right image within the pairing tolerance
  int orphans_right = 0;  ///< right images without a left image within the pairing tolerance
  /// Frames whose stamps do not increase within their pair: the smallest set without which the stamps increase.
  int reversals = 0;
  int gaps = 0;              ///< intervals between complete frames of an odometry pair above three times the median
  double median_step_s = 0;  ///< median interval between complete frames
  double longest_gap_s = 0;  ///< the longest of the gaps; 0 without a gap
  std::vector<std::string> remarks;   ///< other irregularities, e.g. images that times.txt does not list
  std::vector<std::string> warnings;  ///< what the recording does not state and is assumed, e.g. the frame rate
};

/// Properties of an open recording.
struct RecordingInfo : StreamInfo {
  RecordingFormat format = RecordingFormat::spartan;
  std::string layout_reason;  ///< why this layout was chosen, e.g. "calib.txt and image_0 found"
  SequenceReport sequence;
  std::string truth_file;  ///< ground-truth trajectory of the recording; empty without one
};

/// What is known of a sample before its images are read.
struct SampleKey {
  std::string source;                    ///< source_of()
  Stamp stamp;                           ///< stamp_of()
  std::optional<std::int64_t> frame_id;  ///< of a frame, also of one that is missing
};

/// Yields samples ordered by stamp. At equal stamps the order is IMU, wheels, compass, inclinometer, then frames in the
/// order in which the recording lists them. A frame with a reversed stamp is played after the frame listed before it.
/// Sensor samples (not frames) whose stamps do not increase within their table are discarded, as few as possible.
class Recording : public SampleStream {
 public:
  const RecordingInfo& info() const override = 0;

  /// next(), which never waits.
  Result<StreamRead> read(std::chrono::nanoseconds timeout) final;
  std::size_t previews(const std::string& pair) const final { return listed_stamps(pair).size(); }
  Result<StereoFrame> preview(const std::string& pair, std::size_t index) final;

  /// The next sample, or nothing at the end. A listed frame that is missing, unreadable, of another size or out of
  /// order is delivered as MissingFrame. Rows of sensor tables that cannot be parsed are discarded and counted. Errors:
  /// `read_error` and `resources` where the system cannot read a file that is there. The frame concerned was not taken,
  /// so the call may be repeated; after an error in a sensor table every call fails.
  virtual Result<std::optional<Sample>> next() = 0;

  /// Of the sample that next() will take; nothing at the end. Codes: those of next() for sensor tables.
  virtual Result<std::optional<SampleKey>> peek() = 0;
  /// Takes the next sample without opening its images, which are then no part of content_hash(). Codes: as peek().
  virtual Status skip() = 0;

  /// Moves the read position to just after the first `samples_taken` samples of any kind (MissingFrame included),
  /// without decoding an image; their files are read for content_hash(). Positions are counts and not stamps, since
  /// stamps may run backwards. Codes: `input` where the recording holds fewer samples, and those of next().
  virtual Status seek(std::int64_t samples_taken) = 0;

  /// Decodes one frame, independent of the read position: a StereoFrame, or a MissingFrame as next() delivers it. Code
  /// `input` where no frame has this left stamp. Does not change content_hash().
  virtual Result<Sample> sample_at(const std::string& pair, Stamp left_stamp) = 0;
  /// The frame of sample_at(). Code `input` where it is missing, too.
  Result<StereoFrame> frame_at(const std::string& pair, Stamp left_stamp);

  /// Left stamps of all listed frames of a pair, in playback order.
  virtual std::vector<Stamp> listed_stamps(const std::string& pair) const = 0;

  /// Frames of one stop that are complete as far as known without decoding, in playback order.
  virtual std::vector<FrameKey> frames_at(std::int64_t position_id) const = 0;

  /// IMU samples of an interval of `seconds` that starts at `from` (none: at the first sample). Does not move the read
  /// position.
  virtual Result<std::vector<ImuSample>> imu_samples(std::optional<Stamp> from, double seconds) = 0;

  /// Hash of the layout, of all listed frames, with their stamps and the names of their files inside the recording, and
  /// of the names and bytes of the sensor tables. Identifies a recording without reading its images, wherever its
  /// folder is. Codes: `read_error`, `resources` (a table cannot be read).
  virtual Result<std::uint64_t> listing_hash() const = 0;

  /// Hash of everything taken so far by next() or seek(): bytes of the image files, values of sensor samples. A resumed
  /// run compares it to detect that the recording was changed.
  virtual std::uint64_t content_hash() const = 0;
};

/// How to open a recording.
struct OpenOptions {
  std::optional<RecordingFormat> format;  ///< layout of the folder; none: detect it
  std::string rig_file;                   ///< calibration to use instead of the recording's own; empty: its own
  double pair_tolerance_s = 0.005;        ///< largest difference of left and right stamps of one frame, s
  /// Images of the left and the right camera: folders, patterns of file names such as "img/l*.png", or video files,
  /// relative to the folder of the recording. Both or none; none: found by their usual names.
  std::string left_images{}, right_images{};
  std::string times_file{};  ///< times of the frames, read by docs/reference/recording.md; empty: the recording's own
  double fps = 0;            ///< frames per second, instead of the recording's own times; 0: not stated
  int bits = 0;              ///< significant bits of a sample of 16-bit images; 0: by the calibration or the images
  /// Accept a recording without recording.yaml, with the frames that it has now; that of a stream is always accepted.
  bool unfinished = false;

  /// Bounds of what a user states.
  static constexpr double kLeastFps = 0.001, kMostFps = 10000, kMostPairTolerance_s = 1;
  static constexpr int kLeastBits = 9, kMostBits = 16;
};

/// Opens a recording: a folder, or a video file with the left and the right image side by side. Codes: `input`
/// (missing, empty or of unknown layout), `configuration` (calibration).
Result<std::unique_ptr<Recording>> open_recording(const std::string& path, const OpenOptions& options = {});

/// Relabels an image of read_image() with the pixel format of the camera that took it. An image file states only the
/// bits of storage of a sample. The number of significant bits and the Bayer pattern come from the rig (`camera`) and
/// from the frame list of a recording (`bits`; 0: as the camera). Gray samples get the camera's Bayer layout; samples
/// of 16 bits get its significant bits and alignment. Samples are not changed. A format that contradicts the camera is
/// kept: the Imager converts RGB to gray for a gray camera and rejects other mismatches with both formats in the
/// message.
FrameImage interpret(const FrameImage& image, const PixelFormat& camera, int bits = 0);

}  // namespace spartan
