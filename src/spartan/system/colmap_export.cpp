// Export of a run as a model of COLMAP (text format), with its rectified images.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "spartan/core/files.h"
#include "spartan/image_io/image_io.h"
#include "spartan/imaging/imager.h"
#include "spartan/rig/rig.h"
#include "spartan/system/internal/exported_trajectory.h"
#include "spartan/system/internal/terrain_files.h"
#include "spartan/system/run_folder.h"
#include "spartan/system/run_options.h"

namespace spartan {

using namespace internal;

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostPoints = 200'000;
constexpr int kLeftCamera = 1, kRightCamera = 2;

struct ColmapModel {
  std::string cameras = "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[] (fx fy cx cy)\n";
  std::string images = "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, and a line for its points (none)\n";
  std::string points = "# POINT3D_ID X Y Z R G B ERROR TRACK[] (none)\n";
  int image_count = 0;
};

// The centre of the corner pixel is (0, 0) here, (0.5, 0.5) in COLMAP.
void add_cameras(const RectifiedStereo& geometry, ColmapModel& model) {
  constexpr double kHalfPixel = 0.5;
  for (const int camera : {kLeftCamera, kRightCamera}) {
    model.cameras += fmt::format("{} PINHOLE {} {} {:.9g} {:.9g} {:.9g} {:.9g}\n", camera, geometry.size.width,
                                 geometry.size.height, geometry.focal_px, geometry.focal_px,
                                 geometry.centre_px.x() + kHalfPixel, geometry.centre_px.y() + kHalfPixel);
  }
}

void add_image(const Pose& world_from_camera, int camera, const std::string& name, ColmapModel& model) {
  const Pose camera_from_world = world_from_camera.inverse();
  const auto& t = camera_from_world.translation();
  const auto& q = camera_from_world.rotation();
  model.images += fmt::format("{} {:.12f} {:.12f} {:.12f} {:.12f} {:.9f} {:.9f} {:.9f} {} {}\n\n", ++model.image_count,
                              q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z(), camera, name);
}

// Evenly from all points. Their errors are pixels in COLMAP, which are not known here.
void add_points(const PointCloud& cloud, ColmapModel& model) {
  const std::size_t step = (cloud.size() + kMostPoints - 1) / kMostPoints;
  for (std::size_t i = 0; i < cloud.size(); i += std::max<std::size_t>(step, 1)) {
    const auto& [position, colour, sigma_m, time_s] = cloud[i];
    model.points += fmt::format("{} {:.4f} {:.4f} {:.4f} {} {} {} 0\n", i + 1, position.x(), position.y(), position.z(),
                                colour.r, colour.g, colour.b);
  }
}

// The images of both cameras of a frame and their poses. A frame that can no longer be read is an error of the
// recording.
Status add_frame(const FrameRecord& frame, const Pose& world_from_body, Recording& recording, Imager& imager,
                 const fs::path& folder, ColmapModel& model) {
  auto read = recording.frame_at(frame.pair, frame.stamp);
  if (!read) return failure(read);
  const auto pair = imager.process(*read);
  if (!pair) return failure(pair);
  const Pose world_from_left = world_from_body * pair->body_from_left;
  const Pose left_from_right = Pose::from_translation({pair->geometry.baseline_m, 0, 0});
  const struct {
    const char* side;
    int camera;
    ImageView<const std::uint8_t> image;
    Pose pose;
  } views[] = {{"left", kLeftCamera, pair->left, world_from_left},
               {"right", kRightCamera, pair->right, world_from_left * left_from_right}};
  for (const auto& view : views) {
    if (view.image.empty()) continue;
    const std::string name = fmt::format("{}/{}.png", view.side, frame.stamp.ns);
    if (Status s = write_png((folder / "images" / name).string(), view.image); !s) return s;
    add_image(view.pose, view.camera, name, model);
  }
  return {};
}

// The points of all terrain views in the world of a trajectory; files have them in that of the localization. Views of
// frames without a pose in both are left out.
Result<PointCloud> terrain_in_world_of(TrajectoryKind kind, const std::vector<FrameRecord>& frames,
                                       const std::vector<TerrainRecord>& terrain, const std::string& folder) {
  PointCloud all;
  for (const TerrainRecord& view : terrain) {
    const auto frame = std::find_if(frames.begin(), frames.end(), [&](const FrameRecord& each) {
      return each.stamp == view.stamp && each.pair == view.pair;
    });
    if (frame == frames.end()) continue;
    const auto pose = pose_of(*frame, kind), localized = pose_of(*frame, TrajectoryKind::localization);
    if (!pose || !localized) continue;
    auto cloud = terrain_cloud(folder, {view});
    if (!cloud) return cloud;
    if (kind != TrajectoryKind::localization) {
      const Pose moved = pose->pose * localized->pose.inverse();
      for (ColouredPoint& point : *cloud) point.position = (moved * point.position.cast<double>()).cast<float>();
    }
    all.insert(all.end(), cloud->begin(), cloud->end());
  }
  return all;
}

Status write_model(const ColmapModel& model, const fs::path& folder) {
  const fs::path files = folder / "sparse" / "0";
  const std::pair<const char*, const std::string*> texts[] = {
      {"cameras.txt", &model.cameras}, {"images.txt", &model.images}, {"points3D.txt", &model.points}};
  for (const auto& [name, text] : texts) {
    if (Status s = write_file_atomically((files / name).string(), *text); !s) return s;
  }
  return {};
}

Status make_folders(const fs::path& folder) {
  for (const char* name : {"images/left", "images/right", "sparse/0"}) {
    std::error_code error;
    fs::create_directories(folder / name, error);
    if (error) return failure(ErrorCode::output, "cannot be created: " + error.message(), (folder / name).string());
  }
  return {};
}

}  // namespace

Result<int> export_colmap(const std::string& run_folder, Recording& recording, std::optional<TrajectoryKind> kind,
                          const ThreadPool& workers, const std::string& path) {
  const RunFolder folder{run_folder};
  auto store = RunStore::open_read_only(folder.store());
  if (!store) return failure(store);
  const auto frames = store->frames();
  if (!frames) return failure(frames);
  const auto chosen = exported_trajectory(folder, *frames, kind);
  if (!chosen) return failure(chosen);
  const auto options = load_options<RunOptions>(folder.config());
  if (!options) return failure(options);
  const auto rig = read_rig_yaml(folder.rig());
  if (!rig) return failure(rig);
  auto imager = Imager::create(*rig, options->imaging, workers, folder.path);
  if (!imager) return failure(imager);
  if (Status s = make_folders(path); !s) return failure(s);
  ColmapModel model;
  add_cameras(imager->geometry(frames->front().pair), model);
  for (const FrameRecord& frame : *frames) {
    const auto pose = pose_of(frame, *chosen);
    if (!pose || !frame.fault.empty()) continue;  // an image of the frame is missing
    if (Status s = add_frame(frame, pose->pose, recording, *imager, path, model); !s) return failure(s);
  }
  const auto terrain = store->terrain();
  if (!terrain) return failure(terrain);
  const auto cloud = terrain_in_world_of(*chosen, *frames, *terrain, folder.terrain());
  if (!cloud) return failure(cloud);
  add_points(*cloud, model);
  if (Status s = write_model(model, path); !s) return failure(s);
  return model.image_count;
}

}  // namespace spartan
