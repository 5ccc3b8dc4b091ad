// The writers of each format; to_calibration_files() selects one.
#pragma once

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/rig/models/camera_model.h"

namespace spartan::internal {

Result<CalibrationFiles> write_kitti_calib(const Rig& rig, const std::string& path);
Result<CalibrationFiles> write_kitti_raw_calib(const Rig& rig, const std::string& path);
Result<CalibrationFiles> write_middlebury_calib(const Rig& rig, const std::string& path);
Result<CalibrationFiles> write_zed_calib(const Rig& rig, const std::string& path);
Result<CalibrationFiles> write_euroc_calib(const Rig& rig, const std::string& folder);
Result<CalibrationFiles> write_kalibr_calib(const Rig& rig, const std::string& path);
Result<CalibrationFiles> write_opencv_calib(const Rig& rig, const std::string& path);
Result<CalibrationFiles> write_ros_calib(const Rig& rig, const std::string& path);
Result<CalibrationFiles> write_mrcal_calib(const Rig& rig, const std::string& path);
Result<CalibrationFiles> write_tsai_calib(const Rig& rig, const std::string& path);
Result<CalibrationFiles> write_cahvor_calib(const Rig& rig, const std::string& path);

/// The cameras of a rig that consists of one stereo pair.
struct PairCameras {
  const Camera *left, *right;
  const StereoPair* pair;
};
/// Code `configuration`, naming `format`, if the rig has further cameras or pairs.
Result<PairCameras> single_pair(const Rig& rig, CalibrationFormat format);

/// The pinhole cameras of a rectified pair.
struct RectifiedPinholes {
  PairCameras cameras;
  PinholeModel left, right;
  double baseline_m = 0;
};
/// Code `configuration`, naming `format`, unless both cameras are pinholes, side by side, with equal orientation, focal
/// lengths and rows.
Result<RectifiedPinholes> rectified_pinholes(const Rig& rig, CalibrationFormat format);

/// All cameras, beginning with those of the first pair.
std::vector<const Camera*> cameras_pair_first(const Rig& rig);

/// An error of code `configuration` for a camera that a format cannot represent: "cameras.NAME: why".
tl::unexpected<Error> cannot_hold(const Camera& camera, const std::string& why);

}  // namespace spartan::internal
