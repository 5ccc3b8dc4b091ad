// Which reader a calibration file belongs to.
#include "spartan/rig/rig_files.h"

#include <filesystem>
#include <vector>

#include "spartan/core/files.h"
#include "spartan/core/image_io.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;

bool is_there(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error);
}

bool has_line(const std::string& text, const std::string& start) {
  return text.starts_with(start) || text.find("\n" + start) != std::string::npos;
}

// The first picture of image_0 (KITTI odometry) or image_00/data (KITTI raw) beside the file.
ImageSize size_of_pictures_beside(const fs::path& file) {
  for (const char* folder : {"image_0", "image_00/data", "../image_0"}) {
    std::error_code error;
    fs::path first;
    for (const auto& entry : fs::directory_iterator(file.parent_path() / folder, error)) {
      const std::string extension = entry.path().extension().string();
      if (extension != ".png" && extension != ".jpg" && extension != ".pgm") continue;
      if (first.empty() || entry.path() < first) first = entry.path();
    }
    if (first.empty()) continue;
    if (const auto image = read_image(first.string())) return image->size();
  }
  return {};
}

Result<Rig> read_rig_of_folder(const fs::path& folder, ImageSize size_hint) {
  for (const char* name : {"rig.yaml", "calib.txt", "calib_cam_to_cam.txt"}) {
    if (is_there(folder / name)) return read_rig((folder / name).string(), size_hint);
  }
  if (is_there(folder / "cam0" / "sensor.yaml")) return read_euroc_calib(folder.string());
  if (is_there(folder / "mav0")) return read_euroc_calib((folder / "mav0").string());
  return failure(ErrorCode::configuration,
                 "no calibration here: neither rig.yaml, calib.txt, calib_cam_to_cam.txt nor cam0/sensor.yaml",
                 folder.string());
}

}  // namespace

Result<Rig> read_rig(const std::string& path, ImageSize size_hint) {
  const fs::path file(path);
  std::error_code error;
  if (fs::is_directory(file, error)) return read_rig_of_folder(file, size_hint);
  auto text = read_file(path);
  if (!text) {
    text.error().code = ErrorCode::configuration;
    return failure(text);
  }
  const std::string extension = file.extension().string();
  if (has_line(*text, "P_rect_00:")) return read_kitti_raw_calib(path);
  if (has_line(*text, "P0:")) {
    return read_kitti_calib(path, size_hint.empty() ? size_of_pictures_beside(file) : size_hint);
  }
  if (has_line(*text, "T_BS:")) return read_euroc_calib((fs::absolute(file).parent_path().parent_path()).string());
  if (has_line(*text, "schema:")) return parse_rig_yaml(*text, path);
  if (extension == ".xml" || text->find("opencv-matrix") != std::string::npos) {
    const fs::path extrinsics = file.parent_path() / ("extrinsics" + extension);
    const bool apart = file.stem() == "intrinsics" && is_there(extrinsics);
    return read_opencv_calib(path, apart ? extrinsics.string() : "", size_hint);
  }
  if (extension == ".yaml" || extension == ".yml") return parse_rig_yaml(*text, path);
  return failure(ErrorCode::configuration, "this is no calibration that Spartan reads", path,
                 "known: rig.yaml, KITTI calib.txt, KITTI calib_cam_to_cam.txt, EuRoC sensor.yaml, OpenCV yml or xml");
}

}  // namespace spartan
