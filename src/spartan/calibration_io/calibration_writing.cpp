#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <vector>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/calibration_io/internal/calibration_writers.h"
#include "spartan/core/files.h"
#include "spartan/rig/models/camera_model.h"

namespace spartan {

namespace internal {

tl::unexpected<Error> cannot_hold(const Camera& camera, const std::string& why) {
  return failure(ErrorCode::configuration, why, "cameras." + camera.name);
}

Result<PairCameras> single_pair(const Rig& rig, CalibrationFormat format) {
  if (rig.pairs.size() != 1) {
    return failure(ErrorCode::configuration,
                   fmt::format("{} holds one pair, this rig has {}", name_of(format), rig.pairs.size()), "pairs",
                   "choose one with --pair");
  }
  const StereoPair& pair = rig.pairs.front();
  for (const Camera& camera : rig.cameras) {
    if (camera.name == pair.left || camera.name == pair.right) continue;
    return failure(ErrorCode::configuration,
                   fmt::format("{} holds two cameras, this rig has {}", name_of(format), rig.cameras.size()),
                   "cameras." + camera.name, "select the pair with --pair " + pair.name);
  }
  return PairCameras{rig.find_camera(pair.left), rig.find_camera(pair.right), &pair};
}

std::vector<const Camera*> cameras_pair_first(const Rig& rig) {
  const StereoPair& pair = rig.pairs.front();
  std::vector<const Camera*> cameras{rig.find_camera(pair.left), rig.find_camera(pair.right)};
  for (const Camera& camera : rig.cameras) {
    if (camera.name != pair.left && camera.name != pair.right) cameras.push_back(&camera);
  }
  return cameras;
}

namespace {

// Maximum displacement of a pixel by a skew that is treated as a rounding error (JPL vectors with six decimals) and
// dropped in formats without skew, px.
constexpr double kRoundingSkew_px = 0.01;

// The displacement of rows by the skew from one side of the image to the other, px.
double skew_across_px(const Camera& camera) {
  return std::abs(skew_px(camera.model)) * camera.size.width / parameters(camera.model).front().front();
}

// The rig without skew, for formats that do not support it.
Result<Rig> without_skews(Rig rig, CalibrationFormat format) {
  for (Camera& camera : rig.cameras) {
    const double across = skew_across_px(camera);
    if (across > kRoundingSkew_px) {
      return cannot_hold(camera,
                         fmt::format("{} does not support skew, this camera has {:.6g} px: {:.3g} px across the image",
                                     name_of(format), skew_px(camera.model), across));
    }
    camera.model = without_skew(camera.model);
  }
  return rig;
}

Result<CalibrationFiles> write_as(const Rig& rig, CalibrationFormat format, const std::string& path) {
  switch (format) {
    case CalibrationFormat::rig_yaml:
      return CalibrationFiles{{path, to_rig_yaml(rig)}};
    case CalibrationFormat::kitti:
      return write_kitti_calib(rig, path);
    case CalibrationFormat::kitti_raw:
      return write_kitti_raw_calib(rig, path);
    case CalibrationFormat::middlebury:
      return write_middlebury_calib(rig, path);
    case CalibrationFormat::euroc:
      return write_euroc_calib(rig, path);
    case CalibrationFormat::kalibr:
      return write_kalibr_calib(rig, path);
    case CalibrationFormat::opencv:
      return write_opencv_calib(rig, path);
    case CalibrationFormat::ros:
      return write_ros_calib(rig, path);
    case CalibrationFormat::mrcal:
      return write_mrcal_calib(rig, path);
    case CalibrationFormat::tsai:
      return write_tsai_calib(rig, path);
    case CalibrationFormat::cahvor:
      return write_cahvor_calib(rig, path);
    case CalibrationFormat::zed:
      return write_zed_calib(rig, path);
  }
  return failure(ErrorCode::internal, "unknown calibration format");
}

}  // namespace

}  // namespace internal

using namespace internal;

Rig rig_of_pair(const Rig& rig, const StereoPair& pair) {
  Rig only = rig;
  std::erase_if(only.cameras, [&](const Camera& c) { return c.name != pair.left && c.name != pair.right; });
  std::erase_if(only.pairs, [&](const StereoPair& p) { return p.name != pair.name; });
  std::erase_if(only.pan_tilt_units, [&](const PanTiltUnit& unit) {
    return std::none_of(only.cameras.begin(), only.cameras.end(),
                        [&](const Camera& c) { return c.mount == unit.name; });
  });
  return only;
}

Result<CalibrationFiles> to_calibration_files(const Rig& rig, CalibrationFormat format, const std::string& path) {
  if (Status valid = rig.validate("the rig"); !valid) return failure(std::move(valid));
  if (format == CalibrationFormat::rig_yaml || format == CalibrationFormat::cahvor) {
    return write_as(rig, format, path);
  }
  const auto unskewed = without_skews(rig, format);
  if (!unskewed) return failure(unskewed);
  return write_as(*unskewed, format, path);
}

Status write_calibration_files(const CalibrationFiles& files) {
  std::vector<NewFile> contents;
  contents.reserve(files.size());
  for (const CalibrationFile& file : files) {
    const std::string folder = std::filesystem::path(file.path).parent_path().string();
    if (Status made = folder.empty() ? Status() : make_folder(folder); !made) return made;
    contents.push_back({file.path, file.content});
  }
  return write_files_atomically(contents);
}

}  // namespace spartan
