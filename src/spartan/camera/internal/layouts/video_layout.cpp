// Videos: one file with the images of both cameras side by side, or one file per camera.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "spartan/camera/internal/layouts/time_list.h"
#include "spartan/camera/internal/recording_index.h"

namespace spartan::internal {
namespace {

namespace fs = std::filesystem;

struct Times {
  std::vector<Stamp> stamps;
  std::string source;
};

// The times of the frames: from a list, or by the rate.
Result<Times> times_of(const StereoVideo& video, const std::string& path, const OpenOptions& options) {
  Times times;
  if (options.fps == 0 && !options.times_file.empty()) {
    const auto list = read_time_list(options.times_file);
    if (!list) return failure(list);
    for (const TimeRow& row : list->rows) times.stamps.push_back(row.stamp);
    times.source = fmt::format("times in {} from {}", list->unit, fs::path(options.times_file).filename().string());
    return times;
  }
  const double fps = options.fps > 0 ? options.fps : video.fps();
  if (!(fps > 0)) return failure(ErrorCode::input, "states no frame rate", path, "state it with --fps");
  for (std::int64_t i = 0; i < video.announced_frames(); ++i)
    times.stamps.push_back(Stamp{std::llround(1e9 * static_cast<double>(i) / fps)});
  times.source = fmt::format("{:.6g} frames per second", fps);
  return times;
}

}  // namespace

Result<RecordingIndex> index_video(const LayoutChoice& layout, const OpenOptions& options) {
  std::error_code error;
  const bool two = fs::is_directory(layout.folder, error);
  const std::string left = two ? (fs::path(layout.folder) / options.left_images).string() : layout.folder,
                    right = two ? (fs::path(layout.folder) / options.right_images).string() : std::string();
  if (options.rig_file.empty())
    return failure(ErrorCode::input, "a video has no calibration", left, "give one with --rig");
  auto video = StereoVideo::open(left, right);
  if (!video) return failure(video);
  const auto times = times_of(*video, left, options);
  if (!times) return failure(times);
  if (times->stamps.empty()) return failure(ErrorCode::input, "states no number of frames", left);
  auto rig = choose_rig(options, {}, video->size(), {});
  if (!rig) return failure(rig);
  RecordingIndex index;
  index.info.rig = std::move(rig->rig);
  index.info.rig_source = rig->source;
  index.info.layout_reason = times->source;
  const std::string pair = default_pair(index.info.rig);
  const StereoPair* const found = index.info.rig.find_pair(pair);
  for (const std::string& name :
       found == nullptr ? std::vector<std::string>() : std::vector{found->left, found->right}) {
    const ImageSize size = index.info.rig.find_camera(name)->size;
    if (size == video->size()) continue;
    return failure(ErrorCode::input,
                   fmt::format("one image is {}x{}, but camera '{}' in the rig is {}x{}", video->size().width,
                               video->size().height, name, size.width, size.height),
                   left, "the images of both cameras are side by side in equal halves, or in two videos");
  }
  for (std::size_t i = 0; i < times->stamps.size(); ++i) {
    FrameEntry entry;
    entry.frame_id = entry.video_frame = static_cast<std::int64_t>(i);
    entry.pair = pair;
    entry.left_stamp = entry.right_stamp = times->stamps[i];
    entry.left_file = left;
    entry.right_file = two ? right : left;
    index.frames.push_back(std::move(entry));
  }
  index.video = std::make_shared<StereoVideo>(std::move(*video));
  return index;
}

}  // namespace spartan::internal
