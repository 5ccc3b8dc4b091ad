#include "spartan/camera/recording.h"

#include <fmt/format.h>

#include <array>
#include <filesystem>

#include "spartan/camera/internal/recording_index.h"
#include "spartan/camera/internal/sample_depth.h"
#include "spartan/core/files.h"

namespace spartan {

using namespace internal;

namespace {

namespace fs = std::filesystem;

struct FormatEntry {
  RecordingFormat format;
  std::string_view name;
  Result<RecordingIndex> (*index)(const LayoutChoice&, const OpenOptions&);
  // Detects the layout in a folder; nothing where it is absent.
  std::optional<LayoutChoice> (*recognise)(const fs::path&, const OpenOptions&);
};

bool path_exists(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error);
}

std::optional<LayoutChoice> recognise_kitti(const fs::path& folder, const OpenOptions& options) {
  for (const char* images : {"image_0", "image_2"}) {
    if (!path_exists(folder / images)) continue;
    const bool own_rig = path_exists(folder / "calib.txt");
    if (!own_rig && options.rig_file.empty()) continue;
    return LayoutChoice{
        RecordingFormat::kitti, folder.string(),
        own_rig ? fmt::format("calib.txt and {} found", images) : fmt::format("{} found and a rig given", images)};
  }
  return std::nullopt;
}

std::optional<LayoutChoice> recognise_spartan(const fs::path& folder, const OpenOptions&) {
  for (const char* file : {"recording.yaml", "frames.csv"}) {
    if (path_exists(folder / file))
      return LayoutChoice{RecordingFormat::spartan, folder.string(), fmt::format("{} found", file)};
  }
  return std::nullopt;
}

std::optional<LayoutChoice> recognise_kitti_raw(const fs::path& folder, const OpenOptions&) {
  for (const char* images : {"image_00", "image_02"}) {
    if (path_exists(folder / images / "timestamps.txt"))
      return LayoutChoice{RecordingFormat::kitti_raw, folder.string(), fmt::format("{} found", images)};
  }
  return std::nullopt;
}

std::optional<LayoutChoice> recognise_euroc(const fs::path& folder, const OpenOptions&) {
  for (const fs::path& mav : {folder / "mav0", folder}) {
    if (path_exists(mav / "cam0" / "data.csv")) {
      const std::string name = (mav == folder ? "" : "mav0/") + std::string("cam0/data.csv found");
      return LayoutChoice{RecordingFormat::euroc, mav.string(), name};
    }
  }
  return std::nullopt;
}

std::optional<LayoutChoice> recognise_video(const fs::path& folder, const OpenOptions& options) {
  if (!is_video_name(options.left_images) || !is_video_name(options.right_images)) return std::nullopt;
  return LayoutChoice{RecordingFormat::video, folder.string(), "left and right videos given"};
}

// In order of detection: a folder with calib.txt and image_0 is KITTI odometry, whatever else it contains.
constexpr std::array<FormatEntry, 6> kFormats{{
    {RecordingFormat::kitti, "kitti", index_kitti, recognise_kitti},
    {RecordingFormat::spartan, "spartan", index_spartan, recognise_spartan},
    {RecordingFormat::kitti_raw, "kitti-raw", index_kitti_raw, recognise_kitti_raw},
    {RecordingFormat::euroc, "euroc", index_euroc, recognise_euroc},
    {RecordingFormat::images, "images", index_images, recognise_images},
    {RecordingFormat::video, "video", index_video, recognise_video},
}};

constexpr const char* kLookedFor =
    "looked for calib.txt with image_0 and image_1 or image_2 and image_3 (KITTI odometry), image_00/timestamps.txt "
    "(KITTI raw), mav0/cam0/data.csv (EuRoC, TUM-VI), recording.yaml (Spartan), and image folders such as left and "
    "right or cam0 and cam1; name others with --left and --right";

// Files and folders that are no recording of images, and how to make one of them.
std::optional<Error> known_but_not_read(const fs::path& path) {
  const std::string extension = path.extension().string();
  std::error_code error;
  const bool is_file = fs::is_regular_file(path, error);
  const auto metadata = is_file ? Result<std::string>() : read_file((path / "metadata.yaml").string());
  const bool ros1 = is_file && extension == ".bag";
  const bool ros2 = (is_file && (extension == ".db3" || extension == ".mcap")) ||
                    (metadata && metadata->find("rosbag2") != std::string::npos);
  if (!ros1 && !ros2) return std::nullopt;
  return Error{ErrorCode::input, ros1 ? "is a ROS 1 bag, which is not read" : "is a ROS 2 bag, which is not read",
               path.string(), "make a recording of it: spartan-bag import BAG -o RECORDING, of the Python package"};
}

const FormatEntry& entry_of(RecordingFormat format) {
  for (const FormatEntry& entry : kFormats) {
    if (entry.format == format) return entry;
  }
  throw std::invalid_argument("entry_of: no such format");
}

Result<LayoutChoice> choose_layout(const std::string& path, const OpenOptions& options) {
  std::error_code error;
  if (!fs::exists(path, error)) return failure(ErrorCode::input, "no such folder", path, kLookedFor);
  if (auto known = known_but_not_read(path)) return tl::unexpected(std::move(*known));
  if (!fs::is_directory(path, error)) {
    if (is_video_name(path)) return LayoutChoice{RecordingFormat::video, path, "a video, images side by side"};
    return failure(ErrorCode::input, "is a file, neither the folder of a recording nor a video", path);
  }
  const auto names = list_folder(path);
  if (!names) return failure(names);
  if (names->empty()) return failure(ErrorCode::input, "the folder is empty", path, kLookedFor);
  if (options.left_images.empty() != options.right_images.empty())
    return failure(ErrorCode::usage, "--left and --right belong together", path);
  if (!options.left_images.empty() && !options.format) {
    const auto videos = recognise_video(path, options);
    return videos ? *videos : *recognise_images(path, options);
  }
  if (options.format) {
    auto layout = entry_of(*options.format).recognise(path, options);
    if (!layout) layout = LayoutChoice{*options.format, path, ""};
    layout->reason = fmt::format("{} requested", name_of(*options.format));
    return *layout;
  }
  std::optional<LayoutChoice> chosen;
  for (const FormatEntry& entry : kFormats) {
    const auto layout = entry.recognise(path, options);
    if (layout && chosen && entry.format != RecordingFormat::images)
      chosen->reason += fmt::format("; --format {} is also possible: {}", entry.name, layout->reason);
    if (layout && !chosen) chosen = layout;
  }
  if (!chosen) return failure(ErrorCode::input, "is not a recording of a known layout", path, kLookedFor);
  return *chosen;
}

}  // namespace

std::string_view name_of(RecordingFormat format) {
  return entry_of(format).name;
}

Result<RecordingFormat> parse_recording_format(std::string_view name) {
  std::string known;
  for (const FormatEntry& entry : kFormats) {
    if (entry.name == name) return entry.format;
    known += (known.empty() ? "" : ", ") + std::string(entry.name);
  }
  return failure(ErrorCode::usage, fmt::format("unknown recording format '{}'", name), {}, "choose one of " + known);
}

Result<std::unique_ptr<Recording>> open_recording(const std::string& path, const OpenOptions& options) {
  const auto layout = choose_layout(path, options);
  if (!layout) return failure(layout);
  auto index = entry_of(layout->format).index(*layout, options);
  if (!index) return failure(index);
  RecordingInfo& info = index->info;
  info.path = path;
  info.format = layout->format;
  info.layout_reason = layout->reason + (info.layout_reason.empty() ? "" : "; " + info.layout_reason);
  info.has_imu = static_cast<bool>(index->imu);
  std::error_code error;
  if (info.name.empty()) info.name = fs::weakly_canonical(path, error).filename().string();
  if (Status status = validate_and_sort(*index, options.pair_tolerance_s); !status) return failure(status);
  if (Status status = set_sample_depth(*index, options.bits); !status) return failure(status);
  return make_indexed_recording(std::move(*index));
}

Result<StreamRead> Recording::read(std::chrono::nanoseconds /*timeout*/) {
  auto sample = next();
  if (!sample) return failure(sample);
  StreamRead read{StreamRead::State::end, std::move(*sample), std::chrono::steady_clock::now()};
  if (read.sample) read.state = StreamRead::State::sample;
  return read;
}

Result<StereoFrame> Recording::frame_at(const std::string& pair, Stamp left_stamp) {
  auto sample = sample_at(pair, left_stamp);
  if (!sample) return failure(sample);
  if (auto* frame = std::get_if<StereoFrame>(&*sample)) return std::move(*frame);
  return failure(ErrorCode::input, std::get<MissingFrame>(*sample).message);
}

Result<StereoFrame> Recording::preview(const std::string& pair, std::size_t index) {
  const std::vector<Stamp> stamps = listed_stamps(pair);
  if (index < stamps.size()) return frame_at(pair, stamps[index]);
  return failure(ErrorCode::input, fmt::format("has no frame {} of pair '{}'", index, pair), info().path);
}

}  // namespace spartan
