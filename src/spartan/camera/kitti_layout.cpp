// KITTI odometry: calib.txt, times.txt, image_0/000000.png …, image_1/000000.png …, poses.txt.
// Source: Geiger et al., "Are we ready for autonomous driving?", CVPR 2012; the development kit's readme.
#include <fmt/format.h>

#include <filesystem>

#include "spartan/camera/image_folder.h"
#include "spartan/camera/recording_index.h"
#include "spartan/camera/shot_tables.h"
#include "spartan/rig/formats/rig_files.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kAssumedStepNs = 100'000'000;  // KITTI's cameras ran at 10 Hz

Result<std::vector<Stamp>> read_times(const std::string& path) {
  auto table = TableReader::open(path, {});
  if (!table) return failure(table);
  return read_kitti_times(std::move(*table));
}

// Beside the images, or where the original data set keeps it: poses/06.txt beside sequences/06.
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
    if (read->empty()) return failure(ErrorCode::input, "announces no shot: it holds no time", times.string());
    stamps = std::move(*read);
  } else {
    index.info.layout_reason = "no times.txt: images are taken to be 0.1 s apart";
  }
  const std::string left = (folder / "image_0").string(), right = (folder / "image_1").string();
  NumberedImages images = number_images(left, right, stamps ? std::optional(stamps->size()) : std::nullopt);
  index.info.sequence.remarks = std::move(images.remarks);
  const auto size = common_image_size(images.shots);
  if (!size) {
    return failure(ErrorCode::input, "holds no image that can be read", left,
                   "looked for 000000.png, 000001.png … (also jpg, pgm)");
  }
  const std::string calib = (folder / "calib.txt").string();
  auto rig = choose_rig(options, calib, *size, [&] { return read_kitti_calib(calib, *size); });
  if (!rig) return failure(rig);
  index.info.rig = std::move(rig->rig);
  index.info.rig_source = rig->source;
  index.info.truth_file = find_truth(folder);

  const std::string pair = only_pair(index.info.rig);
  for (std::size_t i = 0; i < images.shots.size(); ++i) {
    Shot shot;
    shot.frame_id = static_cast<std::int64_t>(i) + (stamps ? 0 : images.first_number);
    shot.pair = pair;
    shot.left_stamp = shot.right_stamp = stamps ? (*stamps)[i] : Stamp{shot.frame_id * kAssumedStepNs};
    shot.left_file = std::move(images.shots[i].left);
    shot.right_file = std::move(images.shots[i].right);
    if (shot.left_file.empty() || shot.right_file.empty()) {
      const bool no_left = shot.left_file.empty();
      shot.fault = no_left ? FrameFault::left_missing : FrameFault::right_missing;
      shot.message = fmt::format("{}: has no image number {}", no_left ? left : right,
                                 static_cast<std::int64_t>(i) + images.first_number);
    }
    index.shots.push_back(std::move(shot));
  }
  return index;
}

}  // namespace spartan
