// Reading calibration files: the native rig.yaml, and what other projects use. Writing others: rig_writing.h.
#pragma once

#include <string>
#include <vector>

#include "spartan/core/result.h"
#include "spartan/rig/formats/calibration_format.h"
#include "spartan/rig/rig.h"
#include "spartan/rig/rig_differences.h"

namespace spartan {

/// Every reader gives a validated rig, or an error of code `configuration` that names file, line or key:
/// missing keys, values that are not finite, matrices that are no rotations, wrong counts of numbers.
/// Files larger than a calibration can be are refused before they are read.

/// What was read, from where, and what a reader had to decide or leave out.
struct ReadRig {
  Rig rig;
  CalibrationFormat format = CalibrationFormat::rig_yaml;
  std::vector<std::string> files;
  std::vector<std::string> notes;       ///< what had to be decided, in sentences; "body: …" first
  std::string body;                     ///< which frame the body is; empty where the file itself says it
  std::vector<RigDifference> left_out;  ///< what a rig has no place for; keys as in rig.yaml, or those of the file
};

/// Any calibration: the format is guessed from name and content; of a folder, from what lies in it. Formats with a
/// file for each eye take "LEFT,RIGHT", or one of the two where the other one lies beside it under the name of the
/// other eye. `size_hint` counts for formats that do not hold the image size; without it, pictures beside tell it.
Result<ReadRig> read_calibration(const std::string& path, ImageSize size_hint = {});
/// The same of a known format, which nothing is guessed for; `path` is a file, or "LEFT,RIGHT".
Result<ReadRig> read_calibration_as(CalibrationFormat format, const std::string& path, ImageSize size_hint = {});
/// The rig of it.
Result<Rig> read_rig(const std::string& path, ImageSize size_hint = {});

/// The native format (docs/formats.md, "rig.yaml"). All faults of a file at once, each with its line.
Result<Rig> read_rig_yaml(const std::string& path);
Result<Rig> parse_rig_yaml(const std::string& text, const std::string& name);
/// parse_rig_yaml() of it gives the same rig, bit for bit.
std::string to_rig_yaml(const Rig& rig);

/// KITTI odometry `calib.txt` (P0 and P1; baseline −P1[3]/P1[0]). The file does not know the image size.
Result<Rig> read_kitti_calib(const std::string& path, ImageSize size);

/// KITTI raw `calib_cam_to_cam.txt`: the rectified gray pair (P_rect_00, P_rect_01, S_rect_00), and the IMU as
/// body where `calib_imu_to_velo.txt` and `calib_velo_to_cam.txt` lie beside it.
Result<Rig> read_kitti_raw_calib(const std::string& path);

/// EuRoC/ASL: `mav0/cam0/sensor.yaml`, `mav0/cam1/sensor.yaml` and further cameras; body is the body frame of T_BS.
/// Models as in Kalibr's files. The first two cameras are the pair.
Result<Rig> read_euroc_calib(const std::string& mav0_folder);

/// Kalibr's camchain: pinhole with radtan, equidistant or no distortion, omni without distortion, ds, eucm with β = 1.
/// Body is the IMU where a camera knows it (T_cam_imu, T_imu_cam), otherwise the left camera, turned. The first two are
/// the pair.
Result<ReadRig> read_kalibr_calib(const std::string& path);

/// OpenCV stereo yml/xml: M1 D1 M2 D2 R T (also K1/K2, cameraMatrix1…), in one file or in an intrinsics and an
/// extrinsics file; R1 R2 P2 in place of R T; or P1 P2 alone, for a pair rectified already. `fisheye_model: 1` says
/// that D1 and D2 are those of cv::fisheye. `size` counts where the file has no image_width/image_height or image_size.
Result<Rig> read_opencv_calib(const std::string& intrinsics_path, const std::string& extrinsics_path, ImageSize size);

/// Two camera_info files of ROS, as camera_calibration_parsers writes them or as a message printed: plumb_bob,
/// rational_polynomial, equidistant (fisheye). How the eyes stand is in R of both and P of the right one.
Result<ReadRig> read_ros_calib(const std::string& left_path, const std::string& right_path);

/// Two files whose frame they do not explain; for the body see file_frame.h.
/// mrcal .cameramodel: LENSMODEL_PINHOLE, OPENCV4, 5, 8 (12 with thin prism 0), CAHVOR, CAHVORE.
Result<ReadRig> read_mrcal_calib(const std::string& left_path, const std::string& right_path);
/// Ames Stereo Pipeline .tsai: pinhole without distortion or with TSAI's. The files do not know the image size.
Result<ReadRig> read_tsai_calib(const std::string& left_path, const std::string& right_path, ImageSize size);
/// JPL .cahv, .cahvor, .cahvore. `size` counts where a file has no Dimensions.
Result<ReadRig> read_cahvor_calib(const std::string& left_path, const std::string& right_path, ImageSize size);

}  // namespace spartan
