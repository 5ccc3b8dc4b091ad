// Checks that an accepted calibration is valid and round-trips through writing and reading.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/rig/describe.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan::testing {

// Whether all numbers have the magnitude of a real camera. Extreme numbers lose digits or overflow in a conversion.
inline bool is_plausible(const Rig& rig) {
  constexpr double kLeastFocal_px = 100, kMost = 1e4, kFarthest_m = 100, kLeastBaseline_m = 1e-3;
  for (const Camera& camera : rig.cameras) {
    const ModelParameters lists = parameters(camera.model);
    for (const double focal_px : lists.front()) {
      if (focal_px < kLeastFocal_px) return false;
    }
    for (const auto& list : lists) {
      if (std::any_of(list.begin(), list.end(), [](double v) { return std::abs(v) > kMost; })) return false;
    }
    if (rig.body_from_camera(camera.name).translation().norm() > kFarthest_m) return false;
  }
  return rig.right_from_left(rig.pairs.front()).translation().norm() > kLeastBaseline_m;
}

inline const char* file_name(CalibrationFormat format) {
  switch (format) {
    case CalibrationFormat::rig_yaml:
      return "rig.yaml";
    case CalibrationFormat::kitti:
      return "calib.txt";
    case CalibrationFormat::kitti_raw:
      return "calib_cam_to_cam.txt";
    case CalibrationFormat::euroc:
      return "mav0";
    case CalibrationFormat::kalibr:
      return "camchain.yaml";
    case CalibrationFormat::opencv:
      return "stereo.yml";
    case CalibrationFormat::ros:
      return "camera_info.yaml";
    case CalibrationFormat::mrcal:
      return "pair.cameramodel";
    case CalibrationFormat::tsai:
      return "pair.tsai";
    case CalibrationFormat::cahvor:
      return "pair.cahvor";
    case CalibrationFormat::middlebury:
      return "calib.txt";
    case CalibrationFormat::zed:
      return "SN1.conf";
  }
  return "";
}

inline void abort_with(const Rig& rig, CalibrationFormat format, const std::string& what) {
  std::fprintf(stderr, "%s: %s\n%s\n", std::string(name_of(format)).c_str(), what.c_str(), to_rig_yaml(rig).c_str());
  __builtin_trap();
}

inline void check_survives_writing(const Rig& rig, CalibrationFormat format) {
  if (!rig.validation_errors().empty()) abort_with(rig, format, "invalid");
  const TemporaryFolder folder;
  const auto files = to_calibration_files(rig, format, folder.path() + "/" + file_name(format));
  const bool plausible = is_plausible(rig);
  if (!files) {
    if (plausible) abort_with(rig, format, "cannot be written: " + files.error().message());
    return;
  }
  for (const CalibrationFile& file : *files) folder.write(file.path.substr(folder.path().size() + 1), file.content);
  const std::string& first = files->front().path;
  const auto again =
      read_calibration(has_file_per_camera(format) ? first + "," + files->at(1).path : first, rig.cameras[0].size);
  if (!plausible) return;
  if (!again) return abort_with(rig, format, "cannot be read again: " + again.error().message());
  for (const RigDifference& each : describe_differences(rig, again->rig)) {
    if (!each.key.ends_with("name")) abort_with(rig, format, each.key + ": " + each.text);
  }
}

inline void check_survives_writing(const Result<LoadedRig>& read) {
  if (read) check_survives_writing(read->rig, read->format);
}

}  // namespace spartan::testing
