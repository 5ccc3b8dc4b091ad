// KITTI odometry layout: calib.txt, times.txt, image_0/000000.png …, image_1/000000.png … (colour: image_2, image_3),
// poses.txt.
// Source: Geiger et al., "Are we ready for autonomous driving?", CVPR 2012; the development kit's readme.
#include <fmt/format.h>

#include <filesystem>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/camera/internal/frame_tables.h"
#include "spartan/camera/internal/layouts/frame_list.h"
#include "spartan/camera/internal/layouts/image_folder.h"
#include "spartan/camera/internal/recording_index.h"

namespace spartan::internal {
namespace {

namespace fs = std::filesystem;

Result<std::vector<Stamp>> read_times(const std::string& path) {
  auto table = TableReader::open(path, {});
  if (!table) return failure(table);
  return read_kitti_times(std::move(*table));
}

// poses.txt in the folder, or its place in the original data set: poses/06.txt beside sequences/06.
std::string find_truth(const fs::path& folder) {
  std::error_code error;
  const fs::path whole = fs::weakly_canonical(folder, error);
  for (const fs::path& path :
       {folder / "poses.txt", whole.parent_path().parent_path() / "poses" / (whole.filename().string() + ".txt")}) {
    if (fs::is_regular_file(path, error)) return path.string();
  }
  return {};
}

// Folders of the images.
struct Folders {
  std::string left, right;
};

// Frames of times.txt: the file number is the row of the time.
Status index_timed_frames(const Folders& folders, const std::string& times, RecordingIndex& index) {
  auto stamps = read_times(times);
  if (!stamps) return failure(stamps);
  if (stamps->empty()) return failure(ErrorCode::input, "lists no frames: the file holds no times", times);
  auto numbered = number_images(folders.left, folders.right, stamps->size());
  if (!numbered) return failure(numbered);
  NumberedImages& images = *numbered;
  index.info.sequence.remarks = std::move(images.remarks);
  const std::string pair = default_pair(index.info.rig);
  for (std::size_t i = 0; i < images.frames.size(); ++i) {
    FrameEntry entry;
    entry.frame_id = static_cast<std::int64_t>(i);
    entry.pair = pair;
    entry.left_stamp = entry.right_stamp = (*stamps)[i];
    entry.left_file = std::move(images.frames[i].left);
    entry.right_file = std::move(images.frames[i].right);
    if (entry.left_file.empty() || entry.right_file.empty()) {
      const bool no_left = entry.left_file.empty();
      entry.fault = no_left ? FrameFault::left_missing : FrameFault::right_missing;
      entry.message = fmt::format("{}: has no image number {}", no_left ? folders.left : folders.right,
                                  static_cast<std::int64_t>(i) + images.first_number);
    }
    index.frames.push_back(std::move(entry));
  }
  return {};
}

}  // namespace

Result<RecordingIndex> index_kitti(const LayoutChoice& layout, const OpenOptions& options) {
  const fs::path folder = layout.folder;
  std::error_code error;
  const bool gray = fs::exists(folder / "image_0", error) || !fs::exists(folder / "image_2", error);
  const Folders folders{(folder / (gray ? "image_0" : "image_2")).string(),
                        (folder / (gray ? "image_1" : "image_3")).string()};
  const auto left = list_images(folders.left), right = list_images(folders.right);
  if (!left) return failure(left);
  if (!right) return failure(right);
  const auto size = common_image_size(*left);
  if (!size) {
    return failure(ErrorCode::input, "holds no readable image", folders.left,
                   "looked for 000000.png, 000001.png … (also jpg, pgm)");
  }
  RecordingIndex index;
  const std::string calib = (folder / "calib.txt").string();
  const KittiPair cameras = gray ? KittiPair::gray : KittiPair::colour;
  auto rig = choose_rig(options, calib, *size, [&] { return read_kitti_calib(calib, *size, cameras); });
  if (!rig) return failure(rig);
  index.info.rig = std::move(rig->rig);
  index.info.rig_source = rig->source;
  index.info.truth_file = find_truth(folder);

  const fs::path times = folder / "times.txt";
  const bool own_times = options.times_file.empty() && options.fps == 0 && fs::exists(times, error);
  if (own_times) {
    if (Status status = index_timed_frames(folders, times.string(), index); !status) return failure(status);
    return index;
  }
  auto frames = list_frames(*left, *right, default_pair(index.info.rig), "", options);
  if (!frames) return failure(frames);
  index.frames = std::move(frames->frames);
  index.info.layout_reason = frames->times;
  index.info.sequence.warnings = std::move(frames->warnings);
  return index;
}

}  // namespace spartan::internal
