// Writes Spartan recordings (docs/reference/recording.md).
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "spartan/camera/sample_stream.h"
#include "spartan/camera/samples.h"
#include "spartan/core/files.h"
#include "spartan/core/result.h"
#include "spartan/core/trajectory.h"
#include "spartan/rig/rig.h"

namespace spartan {

/// Contents of recording.yaml.
struct RecordingOptions {
  std::string name;            ///< shown in reports
  std::string description;     ///< free text
  double gravity_m_s2 = 9.81;  ///< gravitational acceleration at the site
  SensorNoise noise = {};      ///< specified (nominal) sensor noise
};

/// Of a recording of a stream.
RecordingOptions recording_options_of(const StreamInfo& info);

/// Image files of a recording; both are lossless.
enum class ImageFiles {
  png,
  pnm,  ///< PGM and PPM: twice as large, and written in a tenth of the time
};

/// Paths of the images of a frame; empty where there is none.
struct RecordedImages {
  std::string left, right;
};
/// Those in a folder that a RecordingWriter has made, or is making: also of a frame that it has not listed yet, whose
/// files it may still be writing.
RecordedImages find_recorded_images(const std::string& folder, const std::string& pair, Stamp left_stamp);

/// Creates the folder and appends samples. Kinds of samples may be interleaved in any order; within a kind (and within
/// the frames of a pair) stamps must strictly increase. Everything written reads back bit for bit. `add` rejects a
/// sample with code `input`, and writes nothing of it, where its stamp does not increase, a number is not finite or an
/// image does not match the camera in the rig. A frame is on disk when `add` returns, everything else after `finish()`.
/// A recording without recording.yaml is unfinished. create_batched() writes for a stream that does not wait for the
/// disk: a frame is listed, and sensor samples are on disk, after the next sync(), which comes after its images. It can
/// be opened at any time (unfinished_recording.yaml).
class RecordingWriter {
 public:
  /// Starts a recording. `nominal_rig` is written to rig.yaml. Code `output` where the folder exists and is not empty,
  /// or cannot be created; `configuration` where the rig is invalid, an option is out of the bounds of
  /// recording.yaml or a pair name is not usable as a folder name.
  static Result<RecordingWriter> create(const std::string& folder, const Rig& nominal_rig,
                                        const RecordingOptions& options);
  static Result<RecordingWriter> create_batched(const std::string& folder, const Rig& nominal_rig,
                                                const RecordingOptions& options, ImageFiles images);
  /// Resumes an unfinished recording that `create` started for the same rig. Frames with a complete row and both images
  /// can be reused with reuse_frame(); all other data is written again. Starts a recording where there is none.
  static Result<RecordingWriter> resume(const std::string& folder, const Rig& nominal_rig,
                                        const RecordingOptions& options);
  RecordingWriter(RecordingWriter&&) noexcept;
  RecordingWriter& operator=(RecordingWriter&&) noexcept;
  ~RecordingWriter();

  Status add(const StereoFrame& frame);
  /// A frame of which one image is there; the other one is empty, and its file is missing in the recording.
  Status add_partial(const StereoFrame& frame);
  /// Reuses a complete frame of the resumed recording instead of writing it; false where it is absent or incomplete.
  Result<bool> reuse_frame(const std::string& pair, Stamp left_stamp);
  Status add(const ImuSample& sample);
  Status add(const WheelSample& sample);
  Status add(const CompassSample& sample);
  Status add(const InclinometerSample& sample);

  /// Writes the ground truth: truth/rig.yaml and truth/poses.tum (world_from_body).
  Status write_truth(const Rig& true_rig, const Trajectory& poses);
  /// Writes `truth/disparity/<pair>/<stamp>.png` (16 bits, disparity × 256 in px, 0 unknown) and
  /// `truth/mask/<pair>/<stamp>.png` (255 seen by both cameras, 128 by the left one only, 0 by none).
  Status write_truth_disparity(const std::string& pair, Stamp left_stamp, ImageView<const float> disparity,
                               ImageView<const std::uint8_t> mask);

  /// Flushes what was added since the last call to the disk: first the images, then the rows that name them.
  Status sync();
  /// Flushes all tables and writes recording.yaml.
  Status finish();

 private:
  struct State;
  explicit RecordingWriter(std::unique_ptr<State> state);
  Status add_images(const StereoFrame& frame);
  static Result<RecordingWriter> open(const std::string& folder, const Rig& nominal_rig,
                                      const RecordingOptions& options, std::map<std::string, std::string> previous_rows,
                                      FolderLock lock);
  std::unique_ptr<State> state_;
};

/// Copies the images of self-masks, whose names are relative to the folder `from`, to masks/CAMERA.EXTENSION of the
/// folder `to`. Returns the rig with these names. Codes: `configuration` (a mask is missing or unreadable), `output`.
Result<Rig> with_self_masks_in(const std::string& to, Rig rig, const std::string& from);

/// How far a StreamRecorder has come.
struct RecorderProgress {
  std::int64_t frames = 0, sensor_samples = 0;  ///< written
  std::int64_t dropped = 0;                     ///< frames that did not fit into the queue: the disk was too slow
  std::int64_t rejected = 0;                    ///< samples that a recording cannot hold, e.g. with a reversed stamp
  Status status;                                ///< why writing has ended before finish(), e.g. a full disk
};

/// Records a stream while it is used: a thread writes the samples and syncs them every second. A slow or full disk
/// never delays the caller.
class StreamRecorder {
 public:
  /// Codes: as RecordingWriter::create().
  static Result<std::unique_ptr<StreamRecorder>> create(const std::string& folder, const StreamInfo& info,
                                                        ImageFiles images);
  /// Ends like finish().
  ~StreamRecorder();
  StreamRecorder(const StreamRecorder&) = delete;
  StreamRecorder& operator=(const StreamRecorder&) = delete;

  /// Takes a share of the pixels. Placeholders of missing frames are not recorded.
  void add(const Sample& sample);
  /// Number of samples that were added.
  std::int64_t added() const;
  /// Whether the first `count` samples are on disk and listed, or writing has ended; otherwise they will be synced as
  /// soon as they are written.
  bool is_synced(std::int64_t count);
  /// Waits until everything is on disk, and finishes the recording. Codes: `output`, `resources`.
  Status finish();
  RecorderProgress progress() const;

  /// Images that may wait to be written, bytes.
  static constexpr std::size_t kMostBytes = std::size_t{128} << 20U;

 private:
  struct State;
  explicit StreamRecorder(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace spartan
