// Index of a recording before any image is decoded. Each folder layout is read into an index, which one source plays.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "spartan/camera/internal/video.h"
#include "spartan/camera/recording.h"

namespace spartan::internal {

/// One stereo frame as listed by the recording.
struct FrameEntry {
  std::int64_t frame_id = 0;
  std::int64_t position_id = -1;
  std::string pair;
  Stamp left_stamp, right_stamp;      ///< both the same where one image is missing
  std::string left_file, right_file;  ///< paths; empty: the recording lists no such file
  double pan_rad = 0, tilt_rad = 0;
  double exposure_us = 0, gain = 0;
  int bits = 0;                     ///< significant bits of a sample; 0: as in the rig
  std::int64_t video_frame = 0;     ///< number of the frame where the files are videos
  bool right_only = false;          ///< right image without a left one; ignored in the order of left stamps
  Stamp playback_stamp;             ///< merges the frame with other samples; set by validate_and_sort()
  std::optional<FrameFault> fault;  ///< a fault known before decoding
  std::string message;              ///< describes the fault
};

/// Samples of one sensor in file order; nothing at the end.
class SensorStream {
 public:
  virtual ~SensorStream() = default;
  virtual Result<std::optional<Sample>> next() = 0;
  /// Rows discarded so far.
  virtual DiscardedSamples discarded() const { return {}; }
};
/// Opens a stream at its first sample.
using SensorStreamFactory = std::function<Result<std::unique_ptr<SensorStream>>()>;

/// Frames and sensor streams of a recording.
struct RecordingIndex {
  RecordingInfo info;
  std::vector<FrameEntry> frames;                  ///< in file order until validate_and_sort()
  SensorStreamFactory imu;                         ///< empty: no IMU
  std::vector<SensorStreamFactory> other_sensors;  ///< wheels, compass, inclinometer
  std::shared_ptr<StereoVideo> video;              ///< decodes the frames; null: the files are images
  std::vector<std::string> sensor_files;           ///< tables of all sensors; their bytes are part of listing_hash()
};

/// A detected folder layout and the reason for it.
struct LayoutChoice {
  RecordingFormat format = RecordingFormat::kitti;
  std::string folder;
  std::string reason;
};

/// Reads the index of one layout. Codes: `input`, `configuration`.
Result<RecordingIndex> index_kitti(const LayoutChoice& layout, const OpenOptions& options);
Result<RecordingIndex> index_kitti_raw(const LayoutChoice& layout, const OpenOptions& options);
Result<RecordingIndex> index_euroc(const LayoutChoice& layout, const OpenOptions& options);
Result<RecordingIndex> index_spartan(const LayoutChoice& layout, const OpenOptions& options);
Result<RecordingIndex> index_images(const LayoutChoice& layout, const OpenOptions& options);
Result<RecordingIndex> index_video(const LayoutChoice& layout, const OpenOptions& options);

/// The layout of image folders, if `folder` has folders with usual names or `options` name the images.
std::optional<LayoutChoice> recognise_images(const std::filesystem::path& folder, const OpenOptions& options);

/// Marks frames with missing files, reversed stamps, or left and right stamps more than `pair_tolerance_s` apart; sorts
/// the frames of all pairs into playback order; fills `info.sequence`. Code `input` where no frame is usable as far as
/// known without decoding.
Status validate_and_sort(RecordingIndex& index, double pair_tolerance_s);

/// Plays an index that validate_and_sort() has sorted.
std::unique_ptr<Recording> make_indexed_recording(RecordingIndex index);

/// The pair that frames of a layout without pair names belong to: the first odometry pair of the rig, else the first.
std::string default_pair(const Rig& rig);

/// A rig and the file that it was read from.
struct RigChoice {
  Rig rig;
  std::string source;
};
/// The rig of `options.rig_file` if given, else the result of `read_own` for the recording's `own_file`.
Result<RigChoice> choose_rig(const OpenOptions& options, const std::string& own_file, ImageSize size_hint,
                             const std::function<Result<Rig>()>& read_own);

}  // namespace spartan::internal
