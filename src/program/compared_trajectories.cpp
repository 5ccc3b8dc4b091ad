#include "program/compared_trajectories.h"

#include <filesystem>

#include "spartan/rig/formats/rig_files.h"
#include "spartan/rig/pose_convention.h"
#include "spartan/system/run_folder.h"

namespace spartan::program {
namespace {

namespace fs = std::filesystem;

struct Estimate {
  LoadedTrajectory loaded;
  std::string path;
  std::string kind;
};

// Which trajectory of a run folder to take.
Result<TrajectoryKind> choose_kind(const RunFolder& run, const std::string& asked) {
  if (const auto kind = parse_trajectory_kind(asked)) return *kind;
  if (!asked.empty()) return failure(ErrorCode::usage, "is no trajectory of a run", asked);
  for (const TrajectoryKind kind : kTrajectoriesBestFirst) {
    if (fs::exists(run.trajectory(kind))) return kind;
  }
  return failure(ErrorCode::input, "holds no trajectory", run.path,
                 "a run folder has trajectory_odometry.tum and others");
}

// "slam" for a path ".../trajectory_slam.tum", else "file".
std::string kind_of_file(const fs::path& path) {
  for (const TrajectoryKind kind : kTrajectoriesBestFirst) {
    if (path.filename() == fs::path(RunFolder{}.trajectory(kind)).filename()) return std::string(name_of(kind));
  }
  return "file";
}

Result<Estimate> load_estimate(const std::string& path, const std::string& kind) {
  Estimate estimate;
  if (fs::is_directory(path)) {
    const RunFolder run{path};
    const auto chosen = choose_kind(run, kind);
    if (!chosen) return failure(chosen);
    estimate.kind = name_of(*chosen);
    estimate.path = run.trajectory(*chosen);
  } else {
    if (!kind.empty()) {
      return failure(ErrorCode::usage, "--trajectory chooses among those of a run folder, this is a file", path);
    }
    estimate.kind = kind_of_file(path);
    estimate.path = path;
  }
  auto loaded = load_trajectory(estimate.path);
  if (!loaded) return failure(loaded);
  estimate.loaded = std::move(*loaded);
  // A trajectory of a run means the body, and the run's rig knows what the recording's truth means.
  const fs::path rig_path = fs::path(estimate.path).parent_path() / "rig.yaml";
  if (estimate.kind != "file" && fs::exists(rig_path)) {
    const auto rig = read_rig_yaml(rig_path.string());
    if (!rig) return failure(rig);
    estimate.loaded.poses = in_recording_convention(*rig, std::move(estimate.loaded.poses));
  }
  return estimate;
}

Result<std::string> find_truth(const std::string& path) {
  if (!fs::is_directory(path)) return path;
  for (const char* name : {"truth/poses.tum", "poses.txt", "mav0/state_groundtruth_estimate0/data.csv",
                           "state_groundtruth_estimate0/data.csv"}) {
    if (fs::exists(fs::path(path) / name)) return (fs::path(path) / name).string();
  }
  return failure(ErrorCode::input, "is a folder without a true trajectory", path,
                 "known are truth/poses.tum, poses.txt and mav0/state_groundtruth_estimate0/data.csv");
}

void take_stamps_over(Trajectory& to, const Trajectory& from) {
  for (std::size_t i = 0; i < to.size(); ++i) to[i].stamp = from[i].stamp;
}

// A KITTI file without times.txt has a pose for every frame, and so has its counterpart.
Status agree_on_stamps(LoadedTrajectory& estimate, LoadedTrajectory& truth) {
  if (estimate.has_stamps == truth.has_stamps) return {};
  if (estimate.poses.size() != truth.poses.size()) {
    return failure(ErrorCode::input,
                   "a KITTI pose file without times.txt beside it cannot be compared with one of "
                   "another number of poses");
  }
  if (estimate.has_stamps) {
    take_stamps_over(truth.poses, estimate.poses);
  } else {
    take_stamps_over(estimate.poses, truth.poses);
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
  if (const Status status = agree_on_stamps(estimate->loaded, *truth); !status) return failure(status);
  return ComparedTrajectories{std::move(estimate->loaded.poses), std::move(truth->poses), estimate->path, *truth_file,
                              estimate->kind};
}

}  // namespace spartan::program
