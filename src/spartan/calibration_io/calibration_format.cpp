#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <filesystem>

#include "spartan/calibration_io/calibration_files.h"

namespace spartan {
namespace {

struct FormatKind {
  CalibrationFormat format;
  std::string_view name;
  bool file_per_camera, image_size;
};
constexpr std::array<FormatKind, 12> kKinds{{
    {CalibrationFormat::rig_yaml, "rig.yaml", false, true},
    {CalibrationFormat::kitti, "kitti", false, false},
    {CalibrationFormat::kitti_raw, "kitti-raw", false, true},
    {CalibrationFormat::euroc, "euroc", false, true},
    {CalibrationFormat::kalibr, "kalibr", false, true},
    {CalibrationFormat::opencv, "opencv", false, true},
    {CalibrationFormat::ros, "ros", true, true},
    {CalibrationFormat::mrcal, "mrcal", true, true},
    {CalibrationFormat::tsai, "tsai", true, false},
    {CalibrationFormat::cahvor, "cahvor", true, true},
    {CalibrationFormat::middlebury, "middlebury", false, true},
    {CalibrationFormat::zed, "zed", false, true},
}};
static_assert(kKinds[static_cast<std::size_t>(CalibrationFormat::zed)].format == CalibrationFormat::zed);

const FormatKind& kind_of(CalibrationFormat format) {
  return kKinds[static_cast<std::size_t>(format)];
}

bool has_line(const std::string& text, const std::string& start) {
  return text.starts_with(start) || text.find("\n" + start) != std::string::npos;
}

// File extensions that only one format uses.
std::optional<CalibrationFormat> format_of_extension(const std::string& extension) {
  if (extension == ".tsai") return CalibrationFormat::tsai;
  if (extension == ".cahv" || extension == ".cahvor" || extension == ".cahvore") return CalibrationFormat::cahvor;
  if (extension == ".cameramodel") return CalibrationFormat::mrcal;
  if (extension == ".xml") return CalibrationFormat::opencv;
  return std::nullopt;
}

}  // namespace

std::string_view name_of(CalibrationFormat format) {
  return kind_of(format).name;
}

std::optional<CalibrationFormat> calibration_format_named(std::string_view name) {
  for (const FormatKind& kind : kKinds) {
    if (kind.name == name) return kind.format;
  }
  return std::nullopt;
}

std::vector<std::string_view> calibration_format_names() {
  std::vector<std::string_view> names;
  names.reserve(kKinds.size());
  for (const FormatKind& kind : kKinds) names.push_back(kind.name);
  return names;
}

bool has_file_per_camera(CalibrationFormat format) {
  return kind_of(format).file_per_camera;
}

bool contains_image_size(CalibrationFormat format) {
  return kind_of(format).image_size;
}

std::optional<CalibrationFormat> detect_calibration_format(const std::string& path, const std::string& text) {
  const std::string extension = std::filesystem::path(path).extension().string();
  if (const auto format = format_of_extension(extension)) return format;
  if (has_line(text, "[LEFT_CAM_") || has_line(text, "[left_cam_")) return CalibrationFormat::zed;
  if (has_line(text, "P_rect_00:")) return CalibrationFormat::kitti_raw;
  if (has_line(text, "P0:")) return CalibrationFormat::kitti;
  if (has_line(text, "cam0=[") || has_line(text, "cam0 = [")) return CalibrationFormat::middlebury;
  if (has_line(text, "T_BS:")) return CalibrationFormat::euroc;
  if (has_line(text, "schema:")) return CalibrationFormat::rig_yaml;
  if (text.find("opencv-matrix") != std::string::npos) return CalibrationFormat::opencv;
  if (has_line(text, "cam0:")) return CalibrationFormat::kalibr;
  const bool message = (has_line(text, "K:") && has_line(text, "P:")) || (has_line(text, "k:") && has_line(text, "p:"));
  if (message || has_line(text, "projection_matrix:")) return CalibrationFormat::ros;
  if (text.find("LENSMODEL_") != std::string::npos && has_line(text, "{")) return CalibrationFormat::mrcal;
  if (has_line(text, "u_direction")) return CalibrationFormat::tsai;
  if (has_line(text, "Dimensions")) return CalibrationFormat::cahvor;
  if (extension == ".yaml" || extension == ".yml") return CalibrationFormat::rig_yaml;
  return std::nullopt;
}

Result<CalibrationFormat> calibration_format_for_path(const std::string& path) {
  const std::filesystem::path file(path);
  const std::string name = file.filename().string(), extension = file.extension().string();
  std::error_code error;
  if (const auto format = format_of_extension(extension)) return *format;
  if (name == "calib_cam_to_cam.txt") return CalibrationFormat::kitti_raw;
  if (name == "calib.txt") return CalibrationFormat::kitti;
  if (name.find("camchain") != std::string::npos) return CalibrationFormat::kalibr;
  if (name.find("camera_info") != std::string::npos || path.find(',') != std::string::npos) {
    return CalibrationFormat::ros;
  }
  if (extension == ".yml") return CalibrationFormat::opencv;
  if (extension == ".conf") return CalibrationFormat::zed;
  if (extension == ".yaml") return CalibrationFormat::rig_yaml;
  if (extension.empty() || std::filesystem::is_directory(file, error)) return CalibrationFormat::euroc;
  return failure(ErrorCode::usage, "the file name does not determine the format", path,
                 fmt::format("add --to {}", fmt::join(calibration_format_names(), "|")));
}

}  // namespace spartan
