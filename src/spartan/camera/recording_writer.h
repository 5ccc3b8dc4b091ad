// Writes Spartan recordings (docs/formats.md, "Recording").
#pragma once

#include <map>
#include <memory>
#include <string>

#include "spartan/camera/samples.h"
#include "spartan/camera/sensor_noise.h"
#include "spartan/core/result.h"
#include "spartan/core/trajectory.h"
#include "spartan/rig/rig.h"

namespace spartan {

struct RecordingOptions {
  std::string name;
  std::string description;
  double gravity_m_s2 = 9.81;
  SensorNoise noise = {};  ///< as it is believed
};

/// Makes the folder, then takes samples in any order of kinds, each kind (and the shots of each pair) with stamps that
/// increase. What is written reads back bit for bit; what would not is refused with code `input`: stamps that do not
/// increase, numbers that are not finite, images that do not fit the rig's cameras. Nothing of it is recorded then.
/// A shot is in the files when `add` returns, everything else after `finish()`; a recording that was not finished has
/// no recording.yaml.
class RecordingWriter {
 public:
  /// Code `output` where the folder exists and is not empty, or cannot be made; `configuration` for a rig that is not
  /// valid, or has a pair whose name cannot be a folder's.
  static Result<RecordingWriter> create(const std::string& folder, const Rig& believed_rig,
                                        const RecordingOptions& options);
  /// Goes on with a recording that `create` made for the same rig and that was not finished: shots whose row and
  /// images are there can be taken over; everything else is written again. Makes the recording where there is none.
  static Result<RecordingWriter> resume(const std::string& folder, const Rig& believed_rig,
                                        const RecordingOptions& options);
  RecordingWriter(RecordingWriter&&) noexcept;
  RecordingWriter& operator=(RecordingWriter&&) noexcept;
  ~RecordingWriter();

  Status add(const StereoFrame& frame);
  /// Takes over a shot that the resumed recording holds whole; false where it does not.
  Result<bool> take_over(const std::string& pair, Stamp left_stamp);
  Status add(const ImuSample& sample);
  Status add(const WheelSample& sample);
  Status add(const CompassSample& sample);
  Status add(const InclinometerSample& sample);

  /// Writes truth/rig.yaml and truth/poses.tum.
  Status write_truth(const Rig& true_rig, const Trajectory& poses);
  /// Writes truth/disparity/<pair>/<stamp>.png and truth/mask/<pair>/<stamp>.png (255 both eyes, 128 left only, 0
  /// none).
  Status write_truth_disparity(const std::string& pair, Stamp left_stamp, ImageView<const float> disparity,
                               ImageView<const std::uint8_t> mask);

  Status finish();

 private:
  struct State;
  explicit RecordingWriter(std::unique_ptr<State> state);
  static Result<RecordingWriter> open(const std::string& folder, const Rig& believed_rig,
                                      const RecordingOptions& options, std::map<std::string, std::string> rows_before);
  std::unique_ptr<State> state_;
};

}  // namespace spartan
