// Detection of calibrations in files and folders, and selection of their reader.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/calibration_io/internal/calibration_readers.h"
#include "spartan/calibration_io/internal/calibration_text.h"
#include "spartan/calibration_io/internal/pair_of_files.h"
#include "spartan/core/files.h"

namespace spartan {

using namespace internal;

namespace {

namespace fs = std::filesystem;

bool path_exists(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error);
}

// The size of the images in image_0 (KITTI odometry) or image_00/data (KITTI raw) beside the file.
Result<ImageSize> size_of_recording_beside(const fs::path& file) {
  for (const char* folder : {"image_0", "image_00/data", "../image_0"}) {
    auto size = size_of_images_in((file.parent_path() / folder).string());
    if (!size || !size->empty()) return size;
  }
  return ImageSize{};
}

Result<ImageSize> size_of_images_beside(const fs::path& file) {
  const fs::path folder = file.parent_path();
  return size_of_images_in(folder.empty() ? "." : folder.string());
}

// A rig whose reader ignored nothing.
Result<LoadedRig> complete(Result<Rig> rig, CalibrationFormat format, const std::string& file, const char* body) {
  if (!rig) return failure(std::move(rig));
  LoadedRig read;
  read.rig = std::move(*rig);
  read.format = format;
  read.files = {file};
  read.body = body;
  return read;
}

Result<LoadedRig> read_opencv_files(const fs::path& file, ImageSize size_hint) {
  const std::string extension = file.extension().string();
  const fs::path intrinsics = file.parent_path() / ("intrinsics" + extension);
  const fs::path extrinsics = file.parent_path() / ("extrinsics" + extension);
  const bool separate = (file.stem() == "intrinsics" || file.stem() == "extrinsics") && path_exists(intrinsics) &&
                        path_exists(extrinsics);
  const fs::path& first = separate ? intrinsics : file;
  const auto size = size_hint.empty() ? size_of_images_beside(file) : size_hint;
  if (!size) return failure(size);
  return internal::read_opencv(first.string(), separate ? extrinsics.string() : "", *size);
}

// The images beside a file tell which of its cameras are meant, where it has more than those of one size.
Result<LoadedRig> read_zed_file(const fs::path& file, ImageSize size_hint) {
  auto read = read_zed_calib(file.string(), size_hint);
  if (read || !size_hint.empty()) return read;
  const auto size = size_of_images_beside(file);
  if (!size) return failure(size);
  return size->empty() ? read : read_zed_calib(file.string(), *size);
}

Result<LoadedRig> read_file_per_camera(CalibrationFormat format, const std::string& path, ImageSize size_hint) {
  const auto pair = find_pair_of_files(path);
  if (!pair) return failure(pair);
  if (format == CalibrationFormat::ros) return read_ros_calib(pair->left, pair->right);
  if (format == CalibrationFormat::mrcal) return read_mrcal_calib(pair->left, pair->right);
  const auto size = size_hint.empty() ? size_of_images_beside(pair->left) : size_hint;
  if (!size) return failure(size);
  if (format == CalibrationFormat::tsai) return read_tsai_calib(pair->left, pair->right, *size);
  return read_cahvor_calib(pair->left, pair->right, *size);
}

Result<LoadedRig> read_as(CalibrationFormat format, const std::string& path, ImageSize size_hint) {
  const fs::path file(path);
  switch (format) {
    case CalibrationFormat::rig_yaml:
      return complete(read_rig_yaml(path), format, path, "");
    case CalibrationFormat::kitti: {
      const auto size = size_hint.empty() ? size_of_recording_beside(file) : size_hint;
      if (!size) return failure(size);
      return read_kitti(path, *size);
    }
    case CalibrationFormat::kitti_raw:
      return read_kitti_raw(path);
    case CalibrationFormat::euroc: {
      const std::string folder = fs::absolute(file).parent_path().parent_path().string();
      return complete(read_euroc_calib(folder), format, folder, "that of T_BS");
    }
    case CalibrationFormat::middlebury:
      return read_middlebury_calib(path);
    case CalibrationFormat::zed:
      return read_zed_file(file, size_hint);
    case CalibrationFormat::kalibr:
      return read_kalibr_calib(path);
    case CalibrationFormat::opencv:
      return read_opencv_files(file, size_hint);
    default:
      return read_file_per_camera(format, path, size_hint);
  }
}

// .yml and .xml files without a known name: other programs use these extensions too, so the content is checked.
bool is_opencv_file(const fs::path& file) {
  const std::string extension = file.extension().string();
  if (extension != ".yml" && extension != ".xml") return false;
  const auto text = read_calibration_text(file.string());
  return text && text->find("opencv-matrix") != std::string::npos &&
         detect_calibration_format(file.string(), *text) == CalibrationFormat::opencv;
}

bool is_zed_file(const fs::path& file) {
  if (file.extension() != ".conf") return false;
  const auto text = read_calibration_text(file.string());
  return text && detect_calibration_format(file.string(), *text) == CalibrationFormat::zed;
}

// The calibration in a folder: first the file names of known recordings, then a unique candidate.
Result<std::string> find_in_folder(const fs::path& folder) {
  for (const char* name : {"rig.yaml", "calib.txt", "calib_cam_to_cam.txt", "cam0/sensor.yaml", "mav0/cam0/sensor.yaml",
                           "intrinsics.yml", "intrinsics.xml"}) {
    if (path_exists(folder / name)) return (folder / name).string();
  }
  std::vector<std::string> candidates;
  const auto names = list_folder(folder.string());
  if (!names && names.error().code != ErrorCode::input) return failure(names);
  for (const std::string& name : names.value_or(std::vector<std::string>())) {
    const std::string extension = fs::path(name).extension().string();
    const bool of_one_camera = extension == ".tsai" || extension == ".cahv" || extension == ".cahvor" ||
                               extension == ".cahvore" || extension == ".cameramodel";
    const bool yaml = extension == ".yaml" || extension == ".yml";
    const bool is_camchain = yaml && name.find("camchain") != std::string::npos;
    const bool of_ros = name == "left.yaml" && path_exists(folder / "right.yaml");
    if (of_one_camera || is_camchain || of_ros || is_opencv_file(folder / name) || is_zed_file(folder / name))
      candidates.push_back((folder / name).string());
  }
  if (candidates.size() == 1) return candidates.front();
  if (candidates.size() == 2) {
    const auto pair = find_pair_of_files(candidates.front());
    if (pair) return pair->left + "," + pair->right;
  }
  if (!candidates.empty()) {
    return failure(ErrorCode::configuration, "contains more than one calibration", folder.string(), "name the file");
  }
  return failure(
      ErrorCode::configuration,
      "contains no calibration: looked for rig.yaml, calib.txt, calib_cam_to_cam.txt, cam0/sensor.yaml, a camchain, "
      "OpenCV matrices, a ZED's .conf and files of two cameras",
      folder.string());
}

// The files of mrcal may be large and have any name; they are recognized by their beginning.
bool begins_as_mrcal(const fs::path& file) {
  const auto beginning = read_beginning(file.string(), 65536);
  return beginning && detect_calibration_format(file.string(), *beginning) == CalibrationFormat::mrcal;
}

}  // namespace

Result<LoadedRig> read_calibration(const std::string& path, ImageSize size_hint) {
  std::error_code error;
  if (fs::is_directory(path, error)) {
    const auto inside = find_in_folder(path);
    if (!inside) return failure(inside);
    return read_calibration(*inside, size_hint);
  }
  // For "LEFT,RIGHT" the first file determines the format. An existing file whose name contains a comma is that file.
  std::string first = path;
  if (!path_exists(path) && path.find(',') != std::string::npos) first.resize(path.find(','));
  const auto text =
      read_calibration_text(first, begins_as_mrcal(first) ? kLargestModelFile_bytes : kLargestCalibration_bytes);
  if (!text) return failure(text);
  const auto format = detect_calibration_format(first, *text);
  if (!format) {
    return failure(ErrorCode::configuration, "is not a calibration file of a known format", first,
                   "known formats: rig.yaml, KITTI calib.txt and calib_cam_to_cam.txt, Middlebury calib.txt, EuRoC "
                   "sensor.yaml, Kalibr camchain, "
                   "OpenCV yml or xml, ROS camera_info, mrcal .cameramodel, Ames .tsai, JPL .cahvor, ZED .conf");
  }
  if (first != path && !has_file_per_camera(*format)) {
    return failure(ErrorCode::configuration, fmt::format("{} does not use one file per camera", name_of(*format)), path,
                   "name one file");
  }
  return read_calibration_as(*format, path, size_hint);
}

Result<LoadedRig> read_calibration_as(CalibrationFormat format, const std::string& path, ImageSize size_hint) {
  auto read = read_as(format, path, size_hint);
  if (read && !read->body.empty()) read->notes.insert(read->notes.begin(), "body: " + read->body);
  return read;
}

Result<Rig> read_rig(const std::string& path, ImageSize size_hint) {
  return rig_of(read_calibration(path, size_hint));
}

Result<Rig> internal::rig_of(Result<LoadedRig> read) {
  if (!read) return failure(std::move(read));
  return std::move(read->rig);
}

}  // namespace spartan
