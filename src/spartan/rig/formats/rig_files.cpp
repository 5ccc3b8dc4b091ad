// Which reader a calibration belongs to.
#include "spartan/rig/formats/rig_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "spartan/rig/formats/calibration_readers.h"
#include "spartan/rig/formats/calibration_text.h"
#include "spartan/rig/formats/pair_of_files.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;

bool is_there(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error);
}

// The pictures of image_0 (KITTI odometry) or image_00/data (KITTI raw) beside the file.
ImageSize size_of_recording_beside(const fs::path& file) {
  for (const char* folder : {"image_0", "image_00/data", "../image_0"}) {
    const ImageSize size = rig_detail::size_of_pictures_in((file.parent_path() / folder).string());
    if (!size.empty()) return size;
  }
  return {};
}

ImageSize size_of_pictures_beside(const fs::path& file) {
  const fs::path folder = file.parent_path();
  return rig_detail::size_of_pictures_in(folder.empty() ? "." : folder.string());
}

// A rig of which its reader left nothing out.
Result<ReadRig> whole(Result<Rig> rig, CalibrationFormat format, const std::string& file, const char* body) {
  if (!rig) return failure(std::move(rig));
  ReadRig read;
  read.rig = std::move(*rig);
  read.format = format;
  read.files = {file};
  read.body = body;
  return read;
}

Result<ReadRig> read_opencv(const fs::path& file, ImageSize size_hint) {
  const std::string ending = file.extension().string();
  const fs::path intrinsics = file.parent_path() / ("intrinsics" + ending);
  const fs::path extrinsics = file.parent_path() / ("extrinsics" + ending);
  const bool apart =
      (file.stem() == "intrinsics" || file.stem() == "extrinsics") && is_there(intrinsics) && is_there(extrinsics);
  const fs::path& first = apart ? intrinsics : file;
  if (size_hint.empty()) size_hint = size_of_pictures_beside(file);
  return rig_detail::read_opencv(first.string(), apart ? extrinsics.string() : "", size_hint);
}

Result<ReadRig> read_file_per_eye(CalibrationFormat format, const std::string& path, ImageSize size) {
  const auto pair = rig_detail::find_pair_of_files(path);
  if (!pair) return failure(pair);
  if (format == CalibrationFormat::ros) return read_ros_calib(pair->left, pair->right);
  if (format == CalibrationFormat::mrcal) return read_mrcal_calib(pair->left, pair->right);
  if (size.empty()) size = size_of_pictures_beside(pair->left);
  if (format == CalibrationFormat::tsai) return read_tsai_calib(pair->left, pair->right, size);
  return read_cahvor_calib(pair->left, pair->right, size);
}

Result<ReadRig> read_as(CalibrationFormat format, const std::string& path, ImageSize size_hint) {
  const fs::path file(path);
  switch (format) {
    case CalibrationFormat::rig_yaml:
      return whole(read_rig_yaml(path), format, path, "");
    case CalibrationFormat::kitti:
      return rig_detail::read_kitti(path, size_hint.empty() ? size_of_recording_beside(file) : size_hint);
    case CalibrationFormat::kitti_raw:
      return rig_detail::read_kitti_raw(path);
    case CalibrationFormat::euroc: {
      const std::string folder = fs::absolute(file).parent_path().parent_path().string();
      return whole(read_euroc_calib(folder), format, folder, "that of T_BS");
    }
    case CalibrationFormat::kalibr:
      return read_kalibr_calib(path);
    case CalibrationFormat::opencv:
      return read_opencv(file, size_hint);
    default:
      return read_file_per_eye(format, path, size_hint);
  }
}

// Matrices under a name that tells nothing: settings and results of other programs have it too.
bool is_of_opencv(const fs::path& file) {
  const std::string ending = file.extension().string();
  if (ending != ".yml" && ending != ".xml") return false;
  const auto text = rig_detail::read_calibration_text(file.string());
  return text && text->find("opencv-matrix") != std::string::npos &&
         guess_format(file.string(), *text) == CalibrationFormat::opencv;
}

// The calibration in a folder: the files that recordings have, else what can be the only one.
Result<std::string> find_in_folder(const fs::path& folder) {
  for (const char* name : {"rig.yaml", "calib.txt", "calib_cam_to_cam.txt", "cam0/sensor.yaml", "mav0/cam0/sensor.yaml",
                           "intrinsics.yml", "intrinsics.xml"}) {
    if (is_there(folder / name)) return (folder / name).string();
  }
  std::vector<std::string> candidates;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string(), ending = entry.path().extension().string();
    const bool of_an_eye = ending == ".tsai" || ending == ".cahv" || ending == ".cahvor" || ending == ".cahvore" ||
                           ending == ".cameramodel";
    const bool yaml = ending == ".yaml" || ending == ".yml";
    const bool whole = yaml && name.find("camchain") != std::string::npos;
    const bool of_ros = name == "left.yaml" && is_there(folder / "right.yaml");
    if (of_an_eye || whole || of_ros || is_of_opencv(entry.path())) candidates.push_back(entry.path().string());
  }
  std::sort(candidates.begin(), candidates.end());
  if (candidates.size() == 1) return candidates.front();
  if (candidates.size() == 2) {
    const auto pair = rig_detail::find_pair_of_files(candidates.front());
    if (pair) return pair->left + "," + pair->right;
  }
  if (!candidates.empty()) {
    return failure(ErrorCode::configuration, "holds more than one calibration", folder.string(), "name the file");
  }
  return failure(
      ErrorCode::configuration,
      "no calibration here: neither rig.yaml, calib.txt, calib_cam_to_cam.txt, cam0/sensor.yaml, a camchain, "
      "OpenCV's matrices nor files of two eyes",
      folder.string());
}

// mrcal's files may be large, under any name; what they are stands at their beginning.
bool begins_as_mrcal(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return false;
  std::string beginning(65536, ' ');
  std::ifstream stream(file, std::ios::binary);
  stream.read(beginning.data(), static_cast<std::streamsize>(beginning.size()));
  beginning.resize(static_cast<std::size_t>(stream.gcount()));
  return guess_format(file.string(), beginning) == CalibrationFormat::mrcal;
}

}  // namespace

Result<ReadRig> read_calibration(const std::string& path, ImageSize size_hint) {
  std::error_code error;
  if (fs::is_directory(path, error)) {
    const auto inside = find_in_folder(path);
    if (!inside) return failure(inside);
    return read_calibration(*inside, size_hint);
  }
  // Of "LEFT,RIGHT" the first one tells the format; a file whose own name has a comma is that file.
  std::string first = path;
  if (!is_there(path) && path.find(',') != std::string::npos) first.resize(path.find(','));
  const auto text = rig_detail::read_calibration_text(
      first, begins_as_mrcal(first) ? rig_detail::kLargestModelFile_bytes : rig_detail::kLargestCalibration_bytes);
  if (!text) return failure(text);
  const auto format = guess_format(first, *text);
  if (!format) {
    return failure(ErrorCode::configuration, "this is no calibration that Spartan reads", first,
                   "known: rig.yaml, KITTI calib.txt and calib_cam_to_cam.txt, EuRoC sensor.yaml, Kalibr camchain, "
                   "OpenCV yml or xml, ROS camera_info, mrcal .cameramodel, Ames .tsai, JPL .cahvor");
  }
  if (first != path && !has_a_file_per_eye(*format)) {
    return failure(ErrorCode::configuration, fmt::format("{} does not have a file for each eye", name_of(*format)),
                   path, "name one file");
  }
  return read_calibration_as(*format, path, size_hint);
}

Result<ReadRig> read_calibration_as(CalibrationFormat format, const std::string& path, ImageSize size_hint) {
  auto read = read_as(format, path, size_hint);
  if (read && !read->body.empty()) read->notes.insert(read->notes.begin(), "body: " + read->body);
  return read;
}

Result<Rig> read_rig(const std::string& path, ImageSize size_hint) {
  return rig_detail::rig_of(read_calibration(path, size_hint));
}

Result<Rig> rig_detail::rig_of(Result<ReadRig> read) {
  if (!read) return failure(std::move(read));
  return std::move(read->rig);
}

}  // namespace spartan
