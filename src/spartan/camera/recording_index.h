// What a recording holds, before any image is decoded. Every layout is read into this; one source plays it.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "spartan/camera/frame_source.h"

namespace spartan {

/// One shot as the recording announces it.
struct Shot {
  std::int64_t frame_id = 0;
  std::int64_t position_id = -1;
  std::string pair;
  Stamp left_stamp, right_stamp;      ///< where one eye is missing both are the stamp of the other
  std::string left_file, right_file;  ///< paths; empty: the recording has no such file
  double pan_rad = 0, tilt_rad = 0;
  double exposure_us = 0, gain = 0;
  int bits = 0;                     ///< 0: as the rig says
  bool only_right = false;          ///< a right image without partner: stands outside the order of the left list
  Stamp played_at;                  ///< by which it is merged with other samples; set by arrange()
  std::optional<FrameFault> fault;  ///< known without decoding
  std::string message;              ///< about the fault
};

/// Samples of one sensor, one after the other; nothing at the end.
class SampleStream {
 public:
  virtual ~SampleStream() = default;
  virtual Result<std::optional<Sample>> next() = 0;
};
/// Starts a stream from its beginning.
using OpenStream = std::function<Result<std::unique_ptr<SampleStream>>()>;

struct RecordingIndex {
  RecordingInfo info;
  std::vector<Shot> shots;                ///< each pair in the order in which the recording lists it
  OpenStream imu;                         ///< empty: no IMU
  std::vector<OpenStream> other_sensors;  ///< wheels, compass, inclinometer
};

/// Where a layout was found, and why it is taken for that.
struct LayoutChoice {
  RecordingFormat format = RecordingFormat::kitti;
  std::string folder;
  std::string reason;
};

/// One function a layout. Codes: `input`, `configuration`.
Result<RecordingIndex> index_kitti(const LayoutChoice& layout, const OpenOptions& options);
Result<RecordingIndex> index_kitti_raw(const LayoutChoice& layout, const OpenOptions& options);
Result<RecordingIndex> index_euroc(const LayoutChoice& layout, const OpenOptions& options);
Result<RecordingIndex> index_spartan(const LayoutChoice& layout, const OpenOptions& options);

/// Finds missing files, stamps that run backwards or lie apart, gaps; brings the shots of all pairs into the order in
/// which they are played; fills `info.sequence`. Code `input` where no shot is usable as far as can be told without
/// decoding.
Status arrange(RecordingIndex& index, double pair_tolerance_s);

/// Plays an arranged index.
std::unique_ptr<FrameSource> make_indexed_source(RecordingIndex index);

/// The name of the pair that a recording of one unnamed pair takes from a rig: the first for odometry, else the first.
std::string only_pair(const Rig& rig);

/// The rig of `options.rig_file`, or what `read_own` finds in `own_file`.
struct RigChoice {
  Rig rig;
  std::string source;
};
Result<RigChoice> choose_rig(const OpenOptions& options, const std::string& own_file, ImageSize size_hint,
                             const std::function<Result<Rig>()>& read_own);

}  // namespace spartan
