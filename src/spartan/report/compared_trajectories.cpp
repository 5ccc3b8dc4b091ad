#include <filesystem>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/report/report.h"
#include "spartan/rig/rig.h"
#include "spartan/system/run_folder.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;

// Without exceptions: what may not be looked at is taken as absent, and reading it says why.
bool is_there(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error);
}
bool is_folder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

struct Estimate {
  LoadedTrajectory loaded;
  std::string path;
  std::string kind;
};

// Which trajectory of a run folder to take.
Result<TrajectoryKind> choose_kind(const RunFolder& run, const std::string& requested) {
  if (const auto kind = parse_trajectory_kind(requested)) return *kind;
  if (!requested.empty()) return failure(ErrorCode::usage, "is not a trajectory of a run", requested);
  for (const TrajectoryKind kind : kTrajectoriesBestFirst) {
    if (is_there(run.trajectory(kind))) return kind;
  }
  return failure(ErrorCode::input, "contains no trajectory", run.path,
                 "a run folder has trajectory_odometry.tum and others");
}

// "slam" for a path ".../trajectory_slam.tum", else "file".
std::string kind_of_file(const fs::path& path) {
  for (const TrajectoryKind kind : kTrajectories) {
    if (path.filename() == fs::path(RunFolder{}.trajectory(kind)).filename()) return std::string(name_of(kind));
  }
  return "file";
}

Result<Estimate> load_estimate(const std::string& path, const std::string& kind) {
  Estimate estimate;
  if (is_folder(path)) {
    const RunFolder run{path};
    const auto chosen = choose_kind(run, kind);
    if (!chosen) return failure(chosen);
    estimate.kind = name_of(*chosen);
    estimate.path = run.trajectory(*chosen);
  } else {
    if (!kind.empty()) {
      return failure(ErrorCode::usage, "--trajectory selects one of a run folder, but this is a file", path);
    }
    estimate.kind = kind_of_file(path);
    estimate.path = path;
  }
  auto loaded = load_trajectory(estimate.path);
  if (!loaded) return failure(loaded);
  estimate.loaded = std::move(*loaded);
  // Trajectories of a run are poses of the body; the rig states which frame the truth of the recording uses.
  const fs::path rig_path = fs::path(estimate.path).parent_path() / "rig.yaml";
  if (estimate.kind != "file" && is_there(rig_path)) {
    const auto rig = read_rig_yaml(rig_path.string());
    if (!rig) return failure(rig);
    estimate.loaded.poses = in_recording_convention(*rig, std::move(estimate.loaded.poses));
  }
  return estimate;
}

Result<std::string> find_truth(const std::string& path) {
  if (!is_folder(path)) return path;
  for (const char* name : {"truth/poses.tum", "poses.txt", "mav0/state_groundtruth_estimate0/data.csv",
                           "state_groundtruth_estimate0/data.csv", "mav0/mocap0/data.csv", "mocap0/data.csv"}) {
    if (is_there(fs::path(path) / name)) return (fs::path(path) / name).string();
  }
  return failure(ErrorCode::input, "is a folder without a ground-truth trajectory", path,
                 "expected truth/poses.tum, poses.txt, mav0/state_groundtruth_estimate0/data.csv or "
                 "mav0/mocap0/data.csv");
}

void copy_stamps(Trajectory& to, const Trajectory& from) {
  for (std::size_t i = 0; i < to.size(); ++i) to[i].stamp = from[i].stamp;
}

// A KITTI file without times.txt has one pose per frame, and so must the other file.
Status align_stamps(LoadedTrajectory& estimate, LoadedTrajectory& truth) {
  if (estimate.has_stamps == truth.has_stamps) return {};
  if (estimate.poses.size() != truth.poses.size()) {
    return failure(ErrorCode::input,
                   "a KITTI pose file without times.txt beside it cannot be compared with a file "
                   "that has another number of poses");
  }
  if (estimate.has_stamps) {
    copy_stamps(truth.poses, estimate.poses);
  } else {
    copy_stamps(estimate.poses, truth.poses);
  }
  return {};
}

}  // namespace

Result<std::string> load_truth(const std::string& path) {
  auto file = find_truth(path);
  if (!file) return failure(file);
  if (const auto loaded = load_trajectory(*file); !loaded) return failure(loaded);
  return file;
}

Result<ComparedTrajectories> find_trajectories(const std::string& estimate_path, const std::string& truth_path,
                                               const std::string& kind) {
  auto estimate = load_estimate(estimate_path, kind);
  if (!estimate) return failure(estimate);
  const auto truth_file = find_truth(truth_path);
  if (!truth_file) return failure(truth_file);
  auto truth = load_trajectory(*truth_file);
  if (!truth) return failure(truth);
  if (const Status status = align_stamps(estimate->loaded, *truth); !status) return failure(status);
  return ComparedTrajectories{std::move(estimate->loaded.poses), std::move(truth->poses), estimate->path, *truth_file,
                              estimate->kind};
}

}  // namespace spartan
