#include <fmt/format.h>
#include <stdlib.h>

#include <cerrno>
#include <filesystem>
#include <utility>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/core/files.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;

// A temporary folder, removed in the destructor.
class ScratchFolder {
 public:
  static Result<ScratchFolder> make() {
    std::error_code error;
    std::string name = (fs::temp_directory_path(error) / "spartan_XXXXXX").string();
    if (error || ::mkdtemp(name.data()) == nullptr) return write_failure(name, errno);
    return ScratchFolder(name);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  ScratchFolder(ScratchFolder&& other) noexcept : folder_(std::exchange(other.folder_, "")) {}
  ScratchFolder& operator=(ScratchFolder&&) = delete;
  ~ScratchFolder() {
    std::error_code ignored;
    if (!folder_.empty()) fs::remove_all(folder_, ignored);
  }
  const fs::path& folder() const { return folder_; }

 private:
  explicit ScratchFolder(fs::path folder) : folder_(std::move(folder)) {}
  fs::path folder_;
};

// Further files in the folder of the calibration that its reader reads too.
std::vector<fs::path> companion_files(CalibrationFormat format, const fs::path& file) {
  switch (format) {
    case CalibrationFormat::kitti_raw:
      return {"calib_imu_to_velo.txt", "calib_velo_to_cam.txt"};
    case CalibrationFormat::opencv:
      return {"intrinsics" + file.extension().string(), "extrinsics" + file.extension().string()};
    case CalibrationFormat::euroc: {
      constexpr int kMaxFolders = 100;
      std::vector<fs::path> cameras;
      cameras.reserve(kMaxFolders);
      for (int i = 0; i < kMaxFolders; ++i) cameras.push_back(fs::path(fmt::format("cam{}", i)) / "sensor.yaml");
      return cameras;
    }
    default:
      return {};
  }
}

std::string with_destination(std::string text, const std::string& scratch, const std::string& folder) {
  for (std::size_t at = text.find(scratch); at != std::string::npos; at = text.find(scratch, at + folder.size())) {
    text.replace(at, scratch.size(), folder);
  }
  return text;
}

// The folder that contains all files of a calibration.
fs::path folder_of(const CalibrationFiles& files, CalibrationFormat format) {
  const fs::path parent = fs::path(files.front().path).parent_path();
  const fs::path folder = format == CalibrationFormat::euroc ? parent.parent_path() : parent;
  return folder.empty() ? fs::path(".") : folder;
}

// Files of both cameras may have the same name in different folders, so each gets a folder of its destination.
Result<std::vector<std::string>> write_to(const ScratchFolder& scratch, const CalibrationFiles& files,
                                          CalibrationFormat format) {
  const fs::path folder = folder_of(files, format);
  std::vector<std::string> paths;
  paths.reserve(files.size());
  for (const CalibrationFile& file : files) {
    const fs::path destination(file.path);
    const fs::path path =
        has_file_per_camera(format)
            ? scratch.folder() / std::to_string(paths.size()) / destination.filename()
            : scratch.folder() / destination.lexically_normal().lexically_relative(folder.lexically_normal());
    if (Status made = make_folder(path.parent_path().string()); !made) return failure(made);
    if (Status written = write_file_atomically(path.string(), file.content); !written) return failure(written);
    paths.push_back(path.string());
  }
  std::error_code error;
  for (const fs::path& name : companion_files(format, files.front().path)) {
    if (!fs::is_regular_file(folder / name, error) || fs::exists(scratch.folder() / name, error)) continue;
    if (Status made = make_folder((scratch.folder() / name).parent_path().string()); !made) return failure(made);
    fs::copy_file(folder / name, scratch.folder() / name, error);
  }
  return paths;
}

}  // namespace

Result<LoadedRig> read_back(const CalibrationFiles& files, CalibrationFormat format, ImageSize size) {
  const auto scratch = ScratchFolder::make();
  if (!scratch) return failure(scratch);
  const auto paths = write_to(*scratch, files, format);
  if (!paths) return failure(paths);
  auto read =
      read_calibration_as(format, has_file_per_camera(format) ? paths->at(0) + "," + paths->at(1) : paths->at(0), size);
  if (read) return read;
  Error error = read.error();
  for (std::string* text : {&error.what, &error.where}) {
    *text = with_destination(*text, scratch->folder().string(), folder_of(files, format).string());
  }
  return tl::unexpected<Error>(error);
}

}  // namespace spartan
