// The run's database: what was found frame by frame, crash-safe (docs/reference/files.md).
#pragma once

#include <functional>
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
#include "spartan/odometry/odometer.h"
#include "spartan/slam/tile_store.h"

namespace spartan {

/// Where all sensors together put the rover, and what each of them was worth.
struct LocalizationRecord {
  UncertainPose world_from_body, odom_from_body;
  std::optional<double> slip, slip_sigma;
  struct Sensor {
    std::string name, state, reason;
  };
  std::vector<Sensor> sensors;
};

/// One row of the store: a shot that was processed, or one that was announced and is not there.
struct FrameRecord {
  std::int64_t frame_id = 0;
  std::string pair;
  Stamp stamp;
  std::string status;     ///< name_of(TrackingStatus), or "missing"
  std::string fault;      ///< why it is missing: name_of(FrameFault), or "rejected"; empty otherwise
  std::string message;    ///< what to tell people; empty where there is nothing to say
  bool has_pose = false;  ///< false: `world_from_body` is predicted
  UncertainPose world_from_body;
  MotionEstimate motion;
  std::optional<UncertainPose> slam;               ///< odometry with the latest correction by the map; as the next
  std::optional<LocalizationRecord> localization;  ///< none where the shot is missing
  std::vector<StageTime> times;
};

/// A position's map on the disk.
struct MapRecord {
  Stamp stamp;
  std::int64_t position_id = -1;
  int views = 0;
  UncertainPose believed;         ///< world_from_body before the map was looked for in the global one
  UncertainPose world_from_body;  ///< where it was put
  std::string verdict;            ///< of the match: name_of(MatchStatus)
  double overlap = 0;             ///< share of its cells that the global map knew
  int known_cells = 0, obstacles = 0;
};

/// What a terrain view left on the disk.
struct TerrainRecord {
  Stamp stamp;
  std::string pair;
  double density_percent = 0;
  std::int64_t points = 0;
};

/// What must be the same for a run to be resumed.
struct RunIdentity {
  std::string input;    ///< fingerprint of the recording
  std::string options;  ///< config.yaml
  std::string rig;      ///< rig.yaml
};

class RunStore {
 public:
  /// Whether a run was begun in this file: false where it is missing, or was left before its first transaction.
  static Result<bool> holds_a_run(const std::string& path);
  /// A new store; takes the place of one that holds no run. Code `output`.
  static Result<RunStore> create(const std::string& path, const RunIdentity& identity);
  /// An existing one, to go on with. Code `configuration` where it belongs to another input, other options or another
  /// version of the program.
  static Result<RunStore> resume(const std::string& path, const RunIdentity& identity);
  /// An existing one, to read from.
  static Result<RunStore> open_read_only(const std::string& path);
  RunStore(RunStore&&) noexcept;
  RunStore& operator=(RunStore&&) noexcept;
  ~RunStore();

  /// What one step of the drive left behind.
  struct Step {
    std::optional<FrameRecord> frame;
    std::optional<TerrainRecord> terrain;
    std::optional<MapRecord> map;
    std::vector<StageTime> times;  ///< since the last frame, where the step has none itself; kept with that frame
  };
  /// One transaction: the step, what `save` does inside it (the map's tiles) and gives back, the stages' memory behind
  /// the step (only the newest is kept), and how many samples of the source were taken. All of it is in the file
  /// afterwards, or nothing.
  Status commit(const Step& step, const std::function<Result<Bytes>()>& save, std::int64_t samples_taken);

  /// The global map's tables.
  TileStore& tiles();

  Result<std::vector<FrameRecord>> frames();
  Result<std::vector<TerrainRecord>> terrain();
  Result<std::vector<MapRecord>> maps();

  struct Memory {
    Bytes stages;
    std::int64_t samples_taken = 0;
  };
  /// Nothing where no frame was committed.
  Result<std::optional<Memory>> memory();

 private:
  struct State;
  explicit RunStore(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace spartan
