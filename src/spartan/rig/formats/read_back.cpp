#include "spartan/rig/formats/read_back.h"

#include <fmt/format.h>
#include <stdlib.h>

#include <cerrno>
#include <filesystem>
#include <utility>

#include "spartan/core/files.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;

// A folder that is gone at the end.
class Stage {
 public:
  static Result<Stage> make() {
    std::error_code error;
    std::string name = (fs::temp_directory_path(error) / "spartan_XXXXXX").string();
    if (error || ::mkdtemp(name.data()) == nullptr) return write_failure(name, errno);
    return Stage(name);
  }
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;
  Stage(Stage&& other) noexcept : folder_(std::exchange(other.folder_, "")) {}
  Stage& operator=(Stage&&) = delete;
  ~Stage() {
    std::error_code ignored;
    if (!folder_.empty()) fs::remove_all(folder_, ignored);
  }
  const fs::path& folder() const { return folder_; }

 private:
  explicit Stage(fs::path folder) : folder_(std::move(folder)) {}
  fs::path folder_;
};

// What a reader takes along with the file, from the folder of the calibration.
std::vector<fs::path> read_along(CalibrationFormat format, const fs::path& file) {
  switch (format) {
    case CalibrationFormat::kitti_raw:
      return {"calib_imu_to_velo.txt", "calib_velo_to_cam.txt"};
    case CalibrationFormat::opencv:
      return {"intrinsics" + file.extension().string(), "extrinsics" + file.extension().string()};
    case CalibrationFormat::euroc: {
      constexpr int kMostCameras = 100;
      std::vector<fs::path> cameras;
      cameras.reserve(kMostCameras);
      for (int i = 0; i < kMostCameras; ++i) cameras.push_back(fs::path(fmt::format("cam{}", i)) / "sensor.yaml");
      return cameras;
    }
    default:
      return {};
  }
}

std::string with_places(std::string text, const std::string& stage, const std::string& folder) {
  for (std::size_t at = text.find(stage); at != std::string::npos; at = text.find(stage, at + folder.size())) {
    text.replace(at, stage.size(), folder);
  }
  return text;
}

// The folder that the names of a calibration's files count from.
fs::path folder_of(const CalibrationFiles& files, CalibrationFormat format) {
  const fs::path beside = fs::path(files.front().path).parent_path();
  const fs::path folder = format == CalibrationFormat::euroc ? beside.parent_path() : beside;
  return folder.empty() ? fs::path(".") : folder;
}

// Both eyes' files may be of one name in two folders.
Result<std::vector<std::string>> put_on(const Stage& stage, const CalibrationFiles& files, CalibrationFormat format) {
  const fs::path folder = folder_of(files, format);
  std::vector<std::string> places;
  places.reserve(files.size());
  for (const CalibrationFile& file : files) {
    const fs::path own(file.path);
    const fs::path place = has_a_file_per_eye(format)
                               ? stage.folder() / std::to_string(places.size()) / own.filename()
                               : stage.folder() / own.lexically_normal().lexically_relative(folder.lexically_normal());
    if (Status made = make_folder(place.parent_path().string()); !made) return failure(made);
    if (Status written = write_file_atomically(place.string(), file.content); !written) return failure(written);
    places.push_back(place.string());
  }
  std::error_code error;
  for (const fs::path& name : read_along(format, files.front().path)) {
    if (!fs::is_regular_file(folder / name, error) || fs::exists(stage.folder() / name, error)) continue;
    if (Status made = make_folder((stage.folder() / name).parent_path().string()); !made) return failure(made);
    fs::copy_file(folder / name, stage.folder() / name, error);
  }
  return places;
}

}  // namespace

Result<ReadRig> read_back(const CalibrationFiles& files, CalibrationFormat format, ImageSize size) {
  const auto stage = Stage::make();
  if (!stage) return failure(stage);
  const auto places = put_on(*stage, files, format);
  if (!places) return failure(places);
  auto read = read_calibration_as(
      format, has_a_file_per_eye(format) ? places->at(0) + "," + places->at(1) : places->at(0), size);
  if (read) return read;
  Error error = read.error();
  for (std::string* text : {&error.what, &error.where}) {
    *text = with_places(*text, stage->folder().string(), folder_of(files, format).string());
  }
  return tl::unexpected<Error>(error);
}

}  // namespace spartan
