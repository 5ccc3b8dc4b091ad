#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/core/files.h"
#include "spartan/core/trajectory.h"
#include "spartan/rig/rig.h"
#include "spartan/system/internal/exported_trajectory.h"
#include "spartan/system/internal/terrain_files.h"
#include "spartan/system/map_files.h"
#include "spartan/system/run_folder.h"
#include "spartan/system/run_store.h"

namespace spartan {

using namespace internal;

namespace {

constexpr std::array kFormats{
    ExportDescription{"tum", ExportFormat::tum, ".tum", "trajectory: stamp, position, quaternion (TUM, evo)"},
    ExportDescription{"kitti", ExportFormat::kitti, ".txt",
                      "trajectory: 3x4 matrices of the left camera from its first frame (KITTI)"},
    ExportDescription{"euroc", ExportFormat::euroc, ".csv", "trajectory: stamp in ns, position, quaternion (EuRoC)"},
    ExportDescription{"csv", ExportFormat::csv, ".csv", "trajectory with status, standard deviations and inliers"},
    ExportDescription{"colmap", ExportFormat::colmap, "folder",
                      "rectified images with their poses (COLMAP text model); of a live run by --recording"},
    ExportDescription{"geotiff", ExportFormat::geotiff, ".tif", "global map, all layers (cloud-optimized GeoTIFF)"},
    ExportDescription{"gltf", ExportFormat::gltf, ".glb", "global map as a mesh in the colours of the images (glTF)"},
    ExportDescription{"octomap", ExportFormat::octomap, ".bt", "global map as an octree (OctoMap)"},
    ExportDescription{"ply", ExportFormat::ply, ".ply", "terrain point clouds (PLY: Open3D, MeshLab, CloudCompare)"},
    ExportDescription{"pcd", ExportFormat::pcd, ".pcd", "terrain point clouds (PCD: PCL)"}};

Result<std::string> kitti_text(const RunFolder& folder, const std::vector<FrameRecord>& frames, TrajectoryKind kind) {
  const auto rig = read_rig_yaml(folder.rig());
  if (!rig) return failure(rig);
  const StereoPair* const pair = rig->find_pair(frames.front().pair);
  if (pair == nullptr)
    return failure(ErrorCode::input, "has no pair named '" + frames.front().pair + "'", folder.rig());
  return to_kitti(in_left_optical_convention(*rig, *pair, trajectory_without_gaps(frames, kind)));
}

constexpr int kPoseColumns = 13;

std::string csv_text(const std::vector<FrameRecord>& frames, TrajectoryKind kind) {
  std::string text =
      "frame_id,stamp_ns,status,x_m,y_m,z_m,qx,qy,qz,qw,sigma_x_m,sigma_y_m,sigma_z_m,sigma_rx_rad,sigma_ry_rad,"
      "sigma_rz_rad,matches,inliers,rms_px\n";
  for (const FrameRecord& f : frames) {
    text += fmt::format("{},{},{}", f.frame_id, f.stamp.ns, f.status);
    if (const auto pose = pose_of(f, kind)) {
      const auto& t = pose->pose.translation();
      const auto& q = pose->pose.rotation();
      text += fmt::format(",{:.9f},{:.9f},{:.9f},{:.12f},{:.12f},{:.12f},{:.12f}", t.x(), t.y(), t.z(), q.x(), q.y(),
                          q.z(), q.w());
      for (int i = 0; i < 6; ++i) text += fmt::format(",{:.6g}", std::sqrt(std::max(0.0, pose->covariance(i, i))));
    } else {
      text += std::string(kPoseColumns, ',');
    }
    text += fmt::format(",{},{},{:.4f}\n", f.motion.matches, f.motion.inliers, f.motion.rms_px);
  }
  return text;
}

Result<std::string> trajectory_text(const RunFolder& folder, ExportFormat format, TrajectoryKind kind,
                                    const std::vector<FrameRecord>& frames) {
  switch (format) {
    case ExportFormat::tum:
      return to_tum(trajectory_of(frames, kind));
    case ExportFormat::euroc:
      return to_euroc(trajectory_of(frames, kind));
    case ExportFormat::kitti:
      return kitti_text(folder, frames, kind);
    case ExportFormat::csv:
      return csv_text(frames, kind);
    case ExportFormat::colmap:
    case ExportFormat::geotiff:
    case ExportFormat::gltf:
    case ExportFormat::octomap:
    case ExportFormat::ply:
    case ExportFormat::pcd:
      break;
  }
  return failure(ErrorCode::internal, "is not a trajectory format", folder.path);
}

TrajectoryKind best_of(const std::vector<FrameRecord>& frames) {
  return *std::find_if(kTrajectoriesBestFirst.begin(), kTrajectoriesBestFirst.end(),
                       [&](TrajectoryKind kind) { return has_trajectory(frames, kind); });
}

Status export_whole_map(const std::string& run_folder, MapFormat format, const ThreadPool& workers,
                        const std::string& path) {
  auto saved = SavedMap::open(run_folder);
  if (!saved) return failure(saved);
  const auto view = saved->map().view(saved->map().extent());
  if (!view) return failure(view);
  const auto request = saved->request(*view, format);
  return request ? export_map(*view, *request, workers, path) : Status(failure(request));
}

Status export_terrain(const RunFolder& folder, RunStore& store, ExportFormat format, const std::string& path) {
  const auto terrain = store.terrain();
  if (!terrain) return failure(terrain);
  const auto cloud = terrain_cloud(folder.terrain(), *terrain);
  if (!cloud) return failure(cloud);
  return format == ExportFormat::pcd ? write_pcd(path, *cloud) : write_ply(path, *cloud);
}

}  // namespace

Result<TrajectoryKind> internal::exported_trajectory(const RunFolder& folder, const std::vector<FrameRecord>& frames,
                                                     std::optional<TrajectoryKind> wanted) {
  if (frames.empty()) return failure(ErrorCode::input, "contains no frames", folder.store());
  if (wanted && !has_trajectory(frames, *wanted)) {
    return failure(ErrorCode::input, fmt::format("holds no {} trajectory", name_of(*wanted)), folder.path,
                   "run without --odometry-only");
  }
  return wanted.value_or(best_of(frames));
}

std::span<const ExportDescription> export_descriptions() {
  return kFormats;
}

Result<ExportFormat> parse_export_format(std::string_view name) {
  std::string known;
  for (const ExportDescription& known_format : kFormats) {
    if (known_format.name == name) return known_format.format;
    known += (known.empty() ? "" : ", ") + std::string(known_format.name);
  }
  return failure(ErrorCode::usage, fmt::format("unknown export format '{}'; known: {}", name, known), "--format");
}

Status export_run(const std::string& run_folder, ExportFormat format, std::optional<TrajectoryKind> kind,
                  const ThreadPool& workers, const std::string& path) {
  if (format == ExportFormat::geotiff) return export_whole_map(run_folder, MapFormat::geotiff, workers, path);
  if (format == ExportFormat::octomap) return export_whole_map(run_folder, MapFormat::octomap, workers, path);
  if (format == ExportFormat::gltf) return export_whole_map(run_folder, MapFormat::gltf, workers, path);
  if (format == ExportFormat::colmap)
    return failure(ErrorCode::usage, "needs the images of the recording", "--format colmap", "name it by --recording");
  const RunFolder folder{run_folder};
  auto store = RunStore::open_read_only(folder.store());
  if (!store) return failure(store);
  if (format == ExportFormat::ply || format == ExportFormat::pcd) return export_terrain(folder, *store, format, path);
  const auto frames = store->frames();
  if (!frames) return failure(frames);
  const auto chosen = exported_trajectory(folder, *frames, kind);
  if (!chosen) return failure(chosen);
  const auto text = trajectory_text(folder, format, *chosen, *frames);
  if (!text) return failure(text);
  return write_file_atomically(path, *text);
}

}  // namespace spartan
