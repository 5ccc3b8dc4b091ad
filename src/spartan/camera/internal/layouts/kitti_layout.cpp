// KITTI odometry layout: calib.txt, times.txt, image_0/000000.png …, image_1/000000.png …, poses.txt.
// Source: Geiger et al., "Are we ready for autonomous driving?", CVPR 2012; the development kit's readme.
#include <fmt/format.h>

#include <filesystem>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/camera/internal/frame_tables.h"
#include "spartan/camera/internal/layouts/image_folder.h"
#include "spartan/camera/internal/recording_index.h"

namespace spartan::internal {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kAssumedStepNs = 100'000'000;  // the KITTI cameras ran at 10 Hz

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

}  // namespace

Result<RecordingIndex> index_kitti(const LayoutChoice& layout, const OpenOptions& options) {
  const fs::path folder = layout.folder;
  RecordingIndex index;
  std::optional<std::vector<Stamp>> stamps;
  std::error_code error;
  if (const fs::path times = folder / "times.txt"; fs::exists(times, error)) {
    auto read = read_times(times.string());
    if (!read) return failure(read);
    if (read->empty()) return failure(ErrorCode::input, "lists no frames: the file holds no times", times.string());
    stamps = std::move(*read);
  } else {
    index.info.layout_reason = "no times.txt: frames are assumed to be 0.1 s apart";
  }
  const std::string left = (folder / "image_0").string(), right = (folder / "image_1").string();
  auto numbered = number_images(left, right, stamps ? std::optional(stamps->size()) : std::nullopt);
  if (!numbered) return failure(numbered);
  NumberedImages& images = *numbered;
  index.info.sequence.remarks = std::move(images.remarks);
  const auto size = common_image_size(images.frames);
  if (!size) {
    return failure(ErrorCode::input, "holds no readable image", left,
                   "looked for 000000.png, 000001.png … (also jpg, pgm)");
  }
  const std::string calib = (folder / "calib.txt").string();
  auto rig = choose_rig(options, calib, *size, [&] { return read_kitti_calib(calib, *size); });
  if (!rig) return failure(rig);
  index.info.rig = std::move(rig->rig);
  index.info.rig_source = rig->source;
  index.info.truth_file = find_truth(folder);

  const std::string pair = default_pair(index.info.rig);
  for (std::size_t i = 0; i < images.frames.size(); ++i) {
    FrameEntry entry;
    entry.frame_id = static_cast<std::int64_t>(i) + (stamps ? 0 : images.first_number);
    entry.pair = pair;
    entry.left_stamp = entry.right_stamp = stamps ? (*stamps)[i] : Stamp{entry.frame_id * kAssumedStepNs};
    entry.left_file = std::move(images.frames[i].left);
    entry.right_file = std::move(images.frames[i].right);
    if (entry.left_file.empty() || entry.right_file.empty()) {
      const bool no_left = entry.left_file.empty();
      entry.fault = no_left ? FrameFault::left_missing : FrameFault::right_missing;
      entry.message = fmt::format("{}: has no image number {}", no_left ? left : right,
                                  static_cast<std::int64_t>(i) + images.first_number);
    }
    index.frames.push_back(std::move(entry));
  }
  return index;
}

}  // namespace spartan::internal
