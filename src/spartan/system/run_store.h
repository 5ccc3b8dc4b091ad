// RunStore: the SQLite database of a run, crash-safe (docs/reference/files.md).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "spartan/camera/samples.h"
#include "spartan/core/archive.h"
#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/core/stage_clock.h"
#include "spartan/core/time.h"
#include "spartan/localization/localizer.h"
#include "spartan/odometry/odometer.h"
#include "spartan/slam/tile_store.h"

namespace spartan {

/// Localization at one frame, from all sensors, with the state of each sensor.
struct LocalizationRecord {
  UncertainPose world_from_body, odom_from_body;
  std::optional<double> slip, slip_sigma;
  struct Sensor {
    std::string name, state, reason;  ///< as LocalizationEstimate::health
    /// The last test of an innovation since the frame before; none if there was none, or by an older version.
    std::optional<InnovationTest> test{};
  };
  std::vector<Sensor> sensors;
};

/// One row of the store: a frame that was processed, or one that the recording lists but that is not usable.
struct FrameRecord {
  std::int64_t frame_id = 0;
  std::string pair;
  Stamp stamp;
  std::string status;     ///< name_of(TrackingStatus), or "missing"
  std::string fault;      ///< why it or one of its images is missing: name_of(FrameFault); empty otherwise
  std::string message;    ///< reason for the user to read; may be empty
  bool has_pose = false;  ///< false: `world_from_body` is predicted; no covariance
  UncertainPose world_from_body;
  MotionEstimate motion;                           ///< its covariance includes the errors of the calibration
  std::optional<UncertainPose> slam;               ///< odometry corrected by map matching; none if missing
  std::optional<LocalizationRecord> localization;  ///< none if the frame is missing
  std::optional<UncertainPose> smoothed;           ///< localization by all measurements; none before the end of the run
  std::vector<StageTime> times;
  std::optional<double> latency_ms{};  ///< of a live run: from the arrival of the images to the pose
};

/// The local map of a stop.
struct MapRecord {
  Stamp stamp;
  std::int64_t position_id = -1;
  int views = 0;
  UncertainPose prior;            ///< world_from_body before map matching
  UncertainPose world_from_body;  ///< after map matching: the pose of the map
  std::string status;             ///< of the match: name_of(MatchStatus)
  double overlap = 0;             ///< fraction of its cells that the global map contained
  int known_cells = 0, obstacles = 0;
};

/// The files of a terrain view (terrain_files.h).
struct TerrainRecord {
  Stamp stamp;
  std::string pair;
  double density_percent = 0;  ///< share of pixels with a disparity
  std::int64_t points = 0;     ///< of the point cloud
};

/// Identifies a run: a run can only be resumed with the same identity.
struct RunIdentity {
  std::string input;    ///< fingerprint of the recording
  std::string options;  ///< config.yaml
  std::string rig;      ///< rig.yaml
  /// Of a live run: `options` and `rig` before the first images of the stream completed them, which never come again.
  /// Empty: a run of a recording.
  std::string given_options{}, given_rig{};
  std::string given_keys{};  ///< of the options that the user gave: a default that was given is not completed
  std::optional<Eigen::Vector3d> ground_up{};  ///< by these images, body frame

  bool operator==(const RunIdentity&) const = default;
};

/// Time that a run has taken, interrupted executions of the program included.
struct ElapsedTime {
  double wall_s = 0, cpu_s = 0;
};

/// Results of a run by frame, and the state from which it can be resumed.
class RunStore {
 public:
  /// Whether the file contains a run; false if it is missing, or if the program ended before the first transaction.
  static Result<bool> contains_run(const std::string& path);
  /// What identifies the run in a file; none where it does not contain one. Codes as open_read_only().
  static Result<std::optional<RunIdentity>> identity_of(const std::string& path);
  /// Creates a store; replaces a file without a run. Code `output`.
  static Result<RunStore> create(const std::string& path, const RunIdentity& identity);
  /// Opens a store to resume its run from the latest checkpoint: records after it are removed, since the run makes them
  /// again. Codes: `configuration` if it was written with another input, rig or options, or by another version of the
  /// program; `store_damaged`.
  static Result<RunStore> resume(const std::string& path, const RunIdentity& identity);
  /// Opens a store to read it. Codes: `input` (missing, or not the store of a run), `configuration` (another version),
  /// `store_damaged`.
  static Result<RunStore> open_read_only(const std::string& path);
  RunStore(RunStore&&) noexcept;
  RunStore& operator=(RunStore&&) noexcept;
  ~RunStore();

  /// Results of one step of the run.
  struct Step {
    std::optional<FrameRecord> frame;
    std::optional<TerrainRecord> terrain;
    std::optional<MapRecord> map;
    std::vector<StageTime> times;  ///< for the last frame of the store, if the step has no frame
    Bytes localization_inputs{};   ///< Localizer::take_inputs()
  };
  /// How far the recording was read.
  struct SourcePosition {
    std::int64_t samples_taken = 0;  ///< for Recording::seek()
    std::uint64_t content_hash = 0;  ///< Recording::content_hash()
    /// Of a live stream: the latest stamp of each pair and each sensor (stream_name()).
    std::map<std::string, Stamp> last_stamps{};
  };
  /// Records in the store.
  struct RowCounts {
    std::int64_t frames = 0, terrain = 0, maps = 0;
  };
  /// State from which a run is resumed. Only the latest is kept.
  struct Checkpoint {
    Bytes pipeline_state;  ///< Pipeline::save() after the last step
    SourcePosition source;
    ElapsedTime elapsed{};
    std::optional<RowCounts> rows{};  ///< up to that step, where later ones are committed with it or before; else empty
  };
  /// Writes the steps, and a checkpoint with the changes of the map up to it, in one transaction, completely or not at
  /// all. Codes: `output` if the file cannot be written, was removed, or was changed by another process.
  Status commit(const std::vector<Step>& steps, const std::optional<Checkpoint>& checkpoint = {},
                const MapChanges& maps = {});

  /// Writes FrameRecord::smoothed of every frame, in their order. Codes: as commit().
  Status commit_smoothed(const std::vector<std::optional<UncertainPose>>& poses);
  /// Step::localization_inputs of all steps in their order; none of a run by an older version. Code `store_damaged`.
  Result<std::vector<Bytes>> localization_inputs();

  /// Tables of the global map.
  TileStore& tiles();

  Result<RunIdentity> identity();
  /// All records, or those from number `from` on, in time order. Code `store_damaged`.
  Result<std::vector<FrameRecord>> frames();
  Result<std::vector<TerrainRecord>> terrain(std::int64_t from = 0);
  Result<std::vector<MapRecord>> maps(std::int64_t from = 0);
  /// Calls `take` for each frame from number `from` on, in time order. Rows of frames before are not read. Code
  /// `store_damaged`.
  Status read_frames(std::int64_t from, const std::function<void(FrameRecord&&)>& take);

  Result<RowCounts> row_counts();

  /// The latest checkpoint; none before the first commit.
  Result<std::optional<Checkpoint>> checkpoint();

 private:
  struct State;
  explicit RunStore(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// Consecutive frames at which a sensor was in one state other than ok, for one kind of reason.
struct SensorOutage {
  std::string state;
  std::string reason;  ///< of the first frame, with its numbers
  Stamp from, to;      ///< of the first and of the last frame
  std::int64_t first_frame_id = 0, last_frame_id = 0;
  int frames = 0;
};

/// Outages of one sensor in time order. Two reasons are of one kind if they are equal up to their first colon or digit.
/// A missing frame has no sensor states, so it does not end an outage.
std::vector<SensorOutage> sensor_outages(const std::vector<FrameRecord>& frames, const std::string& sensor);

}  // namespace spartan
