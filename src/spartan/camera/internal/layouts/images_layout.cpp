// Image folders of two cameras without a common standard: left/ and right/, cam0/ and cam1/, or given patterns.
#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <string>
#include <utility>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/camera/internal/layouts/frame_list.h"
#include "spartan/camera/internal/layouts/image_folder.h"
#include "spartan/camera/internal/recording_index.h"

namespace spartan::internal {
namespace {

namespace fs = std::filesystem;

// Folders of the images of a left and a right camera, in order of detection.
constexpr std::array<std::pair<const char*, const char*>, 9> kFolders{{
    {"left", "right"},
    {"cam0", "cam1"},
    {"image_left", "image_right"},
    {"left_images", "right_images"},
    {"images/left", "images/right"},
    {"img_left", "img_right"},
    {"infra1", "infra2"},
    {"cam_left", "cam_right"},
    {"mav0/cam0", "mav0/cam1"},
}};

bool is_folder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

// A folder and a pattern of file names in it. EuRoC keeps the images of a camera in data/ below its folder.
struct ImageSet {
  fs::path folder;
  std::string pattern = "*";
};

ImageSet image_set(const fs::path& recording, const std::string& given) {
  const fs::path path = recording / given;
  if (!is_folder(path)) return {path.parent_path(), path.filename().string()};
  return {is_folder(path / "data") ? path / "data" : path, "*"};
}

Result<std::map<std::string, std::string>> images_of(const ImageSet& set, const char* side) {
  auto images = list_images(set.folder.string(), set.pattern);
  if (images && images->empty()) {
    return failure(ErrorCode::input, fmt::format("holds no image of the {} camera", side),
                   (set.pattern == "*" ? set.folder : set.folder / set.pattern).string(),
                   "images are png, jpg, pgm or ppm files");
  }
  return images;
}

// A list of times beside the image folders.
std::string find_times(const fs::path& folder) {
  std::error_code error;
  for (const char* name : {"times.txt", "timestamps.txt", "times.csv", "timestamps.csv"}) {
    if (fs::is_regular_file(folder / name, error)) return (folder / name).string();
  }
  return {};
}

Result<RigChoice> rig_of_folder(const fs::path& folder, const OpenOptions& options, ImageSize size) {
  if (!options.rig_file.empty()) return choose_rig(options, {}, size, {});
  auto loaded = read_calibration(folder.string(), size);
  if (!loaded) {
    Error error = loaded.error();
    if (error.hint.empty()) error.hint = "give a calibration with --rig";
    return tl::unexpected(std::move(error));
  }
  return RigChoice{std::move(loaded->rig), loaded->files.empty() ? folder.string() : loaded->files.front()};
}

}  // namespace

std::optional<LayoutChoice> recognise_images(const fs::path& folder, const OpenOptions& options) {
  if (!options.left_images.empty())
    return LayoutChoice{RecordingFormat::images, folder.string(), "left and right images given"};
  for (const auto& [left, right] : kFolders) {
    if (is_folder(folder / left) && is_folder(folder / right))
      return LayoutChoice{RecordingFormat::images, folder.string(), fmt::format("{} and {} found", left, right)};
  }
  return std::nullopt;
}

Result<RecordingIndex> index_images(const LayoutChoice& layout, const OpenOptions& options) {
  const fs::path folder = layout.folder;
  std::pair<std::string, std::string> sides{options.left_images, options.right_images};
  for (const auto& [left, right] : kFolders) {
    if (sides.first.empty() && is_folder(folder / left) && is_folder(folder / right)) sides = {left, right};
  }
  if (sides.first.empty()) {
    return failure(ErrorCode::input, "has no image folders with known names, such as left and right", folder.string(),
                   "name the images with --left and --right");
  }
  const auto left = images_of(image_set(folder, sides.first), "left");
  if (!left) return failure(left);
  const auto right = images_of(image_set(folder, sides.second), "right");
  if (!right) return failure(right);
  const auto size = common_image_size(*left);
  if (!size) return failure(ErrorCode::input, "holds no readable image", left->begin()->second);
  RecordingIndex index;
  auto rig = rig_of_folder(folder, options, *size);
  if (!rig) return failure(rig);
  index.info.rig = std::move(rig->rig);
  index.info.rig_source = rig->source;
  auto frames = list_frames(*left, *right, default_pair(index.info.rig), find_times(folder), options);
  if (!frames) return failure(frames);
  index.frames = std::move(frames->frames);
  index.info.layout_reason = frames->times;
  index.info.sequence.warnings = std::move(frames->warnings);
  return index;
}

}  // namespace spartan::internal
