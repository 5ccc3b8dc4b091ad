#include "program/sample_recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

#include "spartan/camera/recording.h"
#include "spartan/core/files.h"
#include "spartan/core/trajectory.h"
#include "spartan/image_io/image_io.h"
#include "spartan/imaging/imager.h"
#include "spartan/system/run_options.h"

namespace spartan::program {
namespace {

// Projection matrices of the gray cameras of KITTI.
std::string calib_text(const RectifiedStereo& stereo) {
  std::string text;
  for (const int camera : {0, 1}) {
    const double shift = camera == 0 ? 0 : -stereo.focal_px * stereo.baseline_m;
    text += fmt::format("P{}: {:.12e} 0 {:.12e} {:.12e} 0 {:.12e} {:.12e} 0 0 0 1 0\n", camera, stereo.focal_px,
                        stereo.centre_px.x(), shift, stereo.focal_px, stereo.centre_px.y());
  }
  return text;
}

Status write_images(const RectifiedPair& pair, int number, const std::string& folder) {
  const std::string name = fmt::format("{:06d}.png", number);
  if (Status s = write_png(folder + "/image_0/" + name, pair.left); !s) return s;
  return write_png(folder + "/image_1/" + name, pair.right);
}

// The true pose of the left camera, relative to that of the first frame; nothing where the truth has no such stamp.
class TrueCameraPoses {
 public:
  explicit TrueCameraPoses(Trajectory truth) : truth_(std::move(truth)) {}

  void add(const RectifiedPair& pair) {
    const auto at = std::find_if(truth_.begin(), truth_.end(),
                                 [&](const StampedPose& pose) { return pose.stamp.ns == pair.stamp.ns; });
    complete_ = complete_ && at != truth_.end();
    if (!complete_) return;
    const Pose world_from_left = at->pose * pair.body_from_left;
    if (poses_.empty()) first_from_world_ = world_from_left.inverse();
    poses_.push_back({pair.stamp, first_from_world_ * world_from_left});
  }
  Status write(const std::string& path) const {
    return complete_ ? write_file_atomically(path, to_kitti(poses_)) : Status();
  }

 private:
  Trajectory truth_, poses_;
  Pose first_from_world_;
  bool complete_ = true;
};

}  // namespace

Status write_kitti_sample(const std::string& recording, int frames, const ThreadPool& workers,
                          const std::string& folder) {
  auto source = open_recording(recording);
  if (!source) return failure(source);
  const RecordingInfo& info = (*source)->info();
  const StereoPair* const pair = odometry_pair_of(info.rig, {});
  if (pair == nullptr) return failure(ErrorCode::configuration, "the rig has no pair for the odometry", recording);
  auto imager = Imager::create(info.rig, {}, workers, recording);
  if (!imager) return failure(imager);
  for (const char* part : {"", "/image_0", "/image_1"}) {
    if (Status s = make_folder(folder + part); !s) return s;
  }
  const auto truth =
      info.truth_file.empty() ? Result<LoadedTrajectory>(LoadedTrajectory()) : load_trajectory(info.truth_file);
  if (!truth) return failure(truth);
  TrueCameraPoses poses(truth->poses);
  std::string times;
  const std::vector<Stamp> stamps = (*source)->listed_stamps(pair->name);
  const int count = std::min(frames, static_cast<int>(stamps.size()));
  for (int i = 0; i < count; ++i) {
    const auto frame = (*source)->frame_at(pair->name, stamps[static_cast<std::size_t>(i)]);
    if (!frame) return failure(frame);
    const auto rectified = imager->process(*frame);
    if (!rectified) return failure(rectified);
    if (Status s = write_images(*rectified, i, folder); !s) return s;
    times += to_decimal_seconds(rectified->stamp) + "\n";
    poses.add(*rectified);
  }
  if (Status s = write_file_atomically(folder + "/calib.txt", calib_text(imager->geometry(pair->name))); !s) return s;
  if (Status s = write_file_atomically(folder + "/times.txt", times); !s) return s;
  return poses.write(folder + "/poses.txt");
}

}  // namespace spartan::program
