// Where samples come from: one interface for recordings of any layout, and for live cameras later.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "spartan/camera/samples.h"
#include "spartan/camera/sensor_noise.h"
#include "spartan/core/result.h"
#include "spartan/rig/rig.h"

namespace spartan {

enum class RecordingFormat { spartan, kitti, kitti_raw, euroc };

/// "spartan", "kitti", "kitti-raw", "euroc": as --format takes them.
std::string_view name_of(RecordingFormat format);
Result<RecordingFormat> parse_recording_format(std::string_view name);

/// What was announced and what of it fits together, found when the recording is opened.
struct SequenceReport {
  int announced = 0;     ///< stereo shots, all pairs
  int orphans_left = 0;  ///< left images without a right one near in time, and the reverse
  int orphans_right = 0;
  int reversals = 0;  ///< stamps that do not increase within a pair: the fewest shots that must go so that they do
  int gaps = 0;       ///< steps between complete shots of a pair for odometry, longer than three times the median step
  double median_step_s = 0;
  double longest_gap_s = 0;          ///< the longest of these steps, 0 where there is no gap
  std::vector<std::string> remarks;  ///< what else is odd: images that times.txt does not announce …
};

struct RecordingInfo {
  std::string path;
  RecordingFormat format = RecordingFormat::spartan;
  std::string layout_reason;  ///< why this layout was taken: "calib.txt and image_0 found"
  Rig rig;
  std::string rig_source;              ///< the file the rig came from
  std::string name;                    ///< as recording.yaml says, else the folder's name
  std::string description;             ///< as recording.yaml says, else empty
  std::optional<double> gravity_m_s2;  ///< as recording.yaml says
  SensorNoise noise;                   ///< as recording.yaml or imu0/sensor.yaml says
  bool has_imu = false;
  SequenceReport sequence;
  std::string truth_file;  ///< trajectory with the truth, where the recording brings one; else empty
};

/// What frame_at() finds a shot by.
struct ShotName {
  std::string pair;
  Stamp left_stamp;
};

/// Yields samples in the order of time; at the same stamp IMU, wheels, compass, inclinometer, then shots in the order
/// in which the recording lists them. A shot whose stamp runs backwards stays behind the shot it is listed after.
/// Sensor samples (not shots) whose stamps do not increase within their table are left out, the fewest that must go.
class FrameSource {
 public:
  virtual ~FrameSource() = default;

  virtual const RecordingInfo& info() const = 0;

  /// The next sample, or nothing at the end. A shot that is announced but missing, unreadable, of another size or
  /// out of order comes as MissingFrame. An error ends the reading (a sensor file that breaks off in mid-line …).
  virtual Result<std::optional<Sample>> next() = 0;

  /// Goes to where `samples_taken` samples of any kind have been handed out by next() since the start (MissingFrame
  /// counts too), without decoding any image: the next one is the one that an undisturbed reader would get. Stamps can
  /// run backwards, so a count says where we are and a stamp does not.
  virtual Status seek(std::int64_t samples_taken) = 0;

  /// Decodes one shot on request. Code `input` where there is none with this left stamp.
  virtual Result<StereoFrame> frame_at(const std::string& pair, Stamp left_stamp) = 0;

  /// Left stamps of all announced shots of a pair, in order.
  virtual std::vector<Stamp> announced_stamps(const std::string& pair) const = 0;

  /// Shots of one position, complete as far as can be told without decoding, in the order in which they are played.
  virtual std::vector<ShotName> shots_at(std::int64_t position_id) const = 0;

  /// IMU samples of `seconds` from a stamp on (none: from the first one on); does not move the reading position.
  virtual Result<std::vector<ImuSample>> imu_samples(std::optional<Stamp> from, double seconds) = 0;

  /// Sensor samples that were left out so far because of their stamps.
  virtual std::int64_t sensor_samples_left_out() const = 0;
};

struct OpenOptions {
  std::optional<RecordingFormat> format;  ///< none: guess
  std::string rig_file;                   ///< replaces the recording's own calibration; empty: its own
  double pair_tolerance_s = 0.005;        ///< left and right stamps farther apart do not form a pair
};

/// Opens a recording. Codes: `input` (missing, empty, no layout that is known), `configuration` (calibration).
Result<std::unique_ptr<FrameSource>> open_recording(const std::string& path, const OpenOptions& options = {});

}  // namespace spartan
