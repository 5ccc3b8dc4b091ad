// A run folder: its files (docs/reference/files.md), its trajectories, and their export in formats of other tools.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "spartan/camera/recording.h"
#include "spartan/core/files.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/core/time.h"
#include "spartan/core/trajectory.h"
#include "spartan/system/run_store.h"

namespace spartan {

/// Odometry: vision alone. SLAM: odometry corrected by map matching. Localization: all sensors. Smoothed: the
/// localization by all measurements of the run, those after each frame included.
enum class TrajectoryKind { odometry, slam, localization, smoothed };
inline constexpr std::array kTrajectories{TrajectoryKind::odometry, TrajectoryKind::slam, TrajectoryKind::localization,
                                          TrajectoryKind::smoothed};
/// Those that were known at each frame.
inline constexpr std::array kTrajectoriesBestFirst{TrajectoryKind::localization, TrajectoryKind::slam,
                                                   TrajectoryKind::odometry};

/// "odometry", "slam", "localization" or "smoothed", as in file names and on the command line.
std::string_view name_of(TrajectoryKind kind);
std::optional<TrajectoryKind> parse_trajectory_kind(std::string_view name);

/// world_from_body of the frame; none where it was not measured. The localization has poses while vision is lost.
std::optional<UncertainPose> pose_of(const FrameRecord& frame, TrajectoryKind kind);

/// Whether a run has this trajectory; a run by odometry alone has no other.
bool has_trajectory(const std::vector<FrameRecord>& frames, TrajectoryKind kind);

/// All measured poses, in time order.
Trajectory trajectory_of(const std::vector<FrameRecord>& frames, TrajectoryKind kind);

/// One pose for every frame: missing poses are extrapolated from the last pose with the odometry's prediction.
Trajectory trajectory_without_gaps(const std::vector<FrameRecord>& frames, TrajectoryKind kind);

/// Paths of the files of a run.
struct RunFolder {
  std::string path;

  std::string store() const { return path + "/run.sqlite"; }
  std::string config() const { return path + "/config.yaml"; }
  std::string rig() const { return path + "/rig.yaml"; }
  std::string input() const { return path + "/input.yaml"; }
  std::string terrain() const { return path + "/terrain"; }
  std::string maps() const { return path + "/maps"; }
  /// What a live run has recorded of its stream, from 1; after each resume another one.
  std::string recording(int number) const { return path + "/live/" + std::to_string(number); }
  /// Without extension.
  std::string local_map(Stamp stamp) const { return maps() + "/local_" + std::to_string(stamp.ns); }
  /// Without extension.
  std::string global_map() const { return maps() + "/global"; }
  std::string trajectory(TrajectoryKind kind) const {
    return path + "/trajectory_" + std::string(name_of(kind)) + ".tum";
  }
  std::string report() const { return path + "/report"; }
  std::string summary() const { return path + "/summary.json"; }
  std::string log() const { return path + "/log.txt"; }
};

/// The recording of a run, and how to read it.
struct RunInput {
  std::string recording;
  OpenOptions open;
};
/// Completes what `given` leaves open by what the run notes of its recording at its start, of older versions by the
/// summary; the calibration is that of the run. `recording` is empty where the run states none or it is not there any
/// more. Code `configuration`: the note is damaged.
Result<RunInput> complete_run_input(RunInput given, const RunFolder& folder);
/// The note, with absolute paths.
Status write_run_input(const RunInput& input, const RunFolder& folder);

enum class FolderState { created, existed };

/// A run folder that no other process works on while this value lives.
struct OwnedRunFolder {
  FolderState state = FolderState::created;
  FolderLock lock;
};

/// Tells early, before anything is computed, what prepare_run_folder() would refuse; nothing is locked or created.
/// Without `resume` also a folder that is not empty. Code `output`.
Status check_run_folder(const RunFolder& folder, bool resume);

/// Creates a new folder; with `resume` an existing one is accepted, and temporary files that a killed process left
/// there are removed. Codes: `output` if it exists and `resume` is false (it stays untouched), if another process works
/// on it, or if it cannot be created; `resources`.
Result<OwnedRunFolder> prepare_run_folder(const RunFolder& folder, bool resume);

/// Sets a run folder aside for a new one. Code `output` if it holds anything that a run does not write, or if another
/// process works on it.
Result<ReplacedFolder> replace_run_folder(const RunFolder& folder);

/// Removes the folder of a run that failed without any result.
void remove_run_folder(const RunFolder& folder);

enum class ExportFormat { tum, kitti, euroc, csv, colmap, geotiff, gltf, octomap, ply, pcd };

struct ExportDescription {
  std::string_view name;  ///< as on the command line
  ExportFormat format;
  std::string_view extension;  ///< of the file; "folder": a folder
  std::string_view content;
};
std::span<const ExportDescription> export_descriptions();

/// Code `usage` for an unknown name.
Result<ExportFormat> parse_export_format(std::string_view name);

/// tum, euroc: world_from_body of every measured pose. kitti: first left optical frame from left optical frame, one
/// line for every listed frame; a frame without a pose has the predicted one. csv: every frame with status, pose and
/// standard deviations (empty without a pose). geotiff, gltf, octomap: the global map. ply, pcd: all terrain point
/// clouds in one file. `kind` selects the trajectory; none: the best that the run has. Codes: `input` (no run, or a run
/// without the requested result), `output`, `usage` (colmap).
Status export_run(const std::string& run_folder, ExportFormat format, std::optional<TrajectoryKind> kind,
                  const ThreadPool& workers, const std::string& path);

/// Writes the folder of a COLMAP project: images/left/STAMP_NS.png and images/right/STAMP_NS.png, rectified, of
/// each measured pose, and sparse/0 with cameras.txt (two PINHOLE cameras), images.txt (poses, camera from world) and
/// points3D.txt (terrain points without tracks, at most 200 000). `recording`: the one that was run, with its images.
/// Returns the number of images. Codes: `input` (no run, no such trajectory, a frame that the recording lacks),
/// `output`.
Result<int> export_colmap(const std::string& run_folder, Recording& recording, std::optional<TrajectoryKind> kind,
                          const ThreadPool& workers, const std::string& path);

}  // namespace spartan
