// Calibration files of all supported formats: detection, reading, writing.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spartan/core/result.h"
#include "spartan/rig/describe.h"
#include "spartan/rig/rig.h"

namespace spartan {

/// The supported formats of calibration files.
enum class CalibrationFormat {
  rig_yaml,
  kitti,
  kitti_raw,
  euroc,
  kalibr,
  opencv,
  ros,
  mrcal,
  tsai,
  cahvor,
  middlebury,
  zed
};

/// The name of a format: "rig.yaml", "kitti", "kitti-raw", "euroc", "kalibr", "opencv", "ros", "mrcal", "tsai",
/// "cahvor", "middlebury", "zed".
std::string_view name_of(CalibrationFormat format);
/// The format with that name, if there is one.
std::optional<CalibrationFormat> calibration_format_named(std::string_view name);
/// The names of all formats.
std::vector<std::string_view> calibration_format_names();

/// Whether the format stores each camera of a pair in a file of its own.
bool has_file_per_camera(CalibrationFormat format);
/// Whether the files contain the image size.
bool contains_image_size(CalibrationFormat format);

/// Detects the format of an existing file from its extension and its text; nullopt if it is unknown.
std::optional<CalibrationFormat> detect_calibration_format(const std::string& path, const std::string& text);
/// The format to write to a path, from its file name; code `usage` if the name does not determine it. A name without
/// extension is a folder of EuRoC's layout.
Result<CalibrationFormat> calibration_format_for_path(const std::string& path);

// Every reader returns a validated rig, or an error of code `configuration` that names file, line or key: missing keys,
// values that are not finite, matrices that are not rotations, wrong numbers of values. Files above a size limit are
// rejected before they are read.

/// The result of reading a calibration: the rig, its source, and decisions of the reader.
struct LoadedRig {
  Rig rig;
  CalibrationFormat format = CalibrationFormat::rig_yaml;
  std::vector<std::string> files;
  std::vector<std::string> notes;      ///< decisions of the reader as text; "body: …" first
  std::string body;                    ///< description of the body frame; empty if the file defines it
  std::vector<RigDifference> ignored;  ///< content that a Rig cannot represent; keys of rig.yaml or of the file
};

/// Reads a calibration of any format, detected from name and content. `path` is a file, a folder that contains one
/// calibration, or, for formats with one file per camera, "LEFT,RIGHT" or one of the two files if the name of the other
/// one follows from it. `size_hint` is the image size for formats that do not contain it; if it is empty, the size is
/// taken from images beside the file.
Result<LoadedRig> read_calibration(const std::string& path, ImageSize size_hint = {});
/// The same for a known format, without detection; `path` is a file or "LEFT,RIGHT".
Result<LoadedRig> read_calibration_as(CalibrationFormat format, const std::string& path, ImageSize size_hint = {});
/// read_calibration() without the additional information.
Result<Rig> read_rig(const std::string& path, ImageSize size_hint = {});

/// The gray or the colour cameras of KITTI.
enum class KittiPair { gray, colour };

/// KITTI odometry `calib.txt`: P0 and P1 (baseline −P1[3]/P1[0]), or P2 and P3 of the colour cameras, whose heights
/// differ by some millimetres. The file does not contain the image size.
Result<Rig> read_kitti_calib(const std::string& path, ImageSize size, KittiPair pair = KittiPair::gray);

/// KITTI raw `calib_cam_to_cam.txt`: the rectified gray pair (P_rect_00, P_rect_01, S_rect_00) or the colour pair
/// (P_rect_02, P_rect_03, S_rect_02), with the IMU as body if `calib_imu_to_velo.txt` and `calib_velo_to_cam.txt` are
/// in the same folder.
Result<Rig> read_kitti_raw_calib(const std::string& path, KittiPair pair = KittiPair::gray);

/// Middlebury (2014 on) and ETH3D two-view `calib.txt`: cam0, cam1, baseline in millimetres, width, height. doffs must
/// be the difference of the principal points; other keys are ignored.
Result<LoadedRig> read_middlebury_calib(const std::string& path);

/// SN….conf of a ZED camera: the cameras of one of its resolutions, `size`; that of the file where it has one only and
/// `size` is empty. Lenses with five or eight coefficients, or those of cv::fisheye.
Result<LoadedRig> read_zed_calib(const std::string& path, ImageSize size = {});

/// EuRoC/ASL: `mav0/cam0/sensor.yaml`, `mav0/cam1/sensor.yaml` and further cameras; the body is the body frame of
/// T_BS. Models as in Kalibr's files. The first two cameras are the pair.
Result<Rig> read_euroc_calib(const std::string& mav0_folder);

/// Kalibr's camchain: pinhole with radtan, equidistant or no distortion, omni without distortion, ds, eucm with β = 1.
/// The body is the IMU if a camera has T_cam_imu or T_imu_cam, otherwise the left camera turned to x forward, y left, z
/// up. The first two cameras are the pair.
Result<LoadedRig> read_kalibr_calib(const std::string& path);

/// OpenCV stereo yml/xml: M1 D1 M2 D2 R T (also K1/K2, cameraMatrix1…), in one file or in an intrinsics and an
/// extrinsics file; R1 R2 P1 P2 instead of R T; or P1 P2 alone for a rectified pair. With `fisheye_model: 1`, D1 and D2
/// are those of cv::fisheye. `size` is used if the file has neither image_width/image_height nor image_size.
Result<Rig> read_opencv_calib(const std::string& intrinsics_path, const std::string& extrinsics_path, ImageSize size);

/// Two camera_info files of ROS, as written by camera_calibration_parsers or as printed messages: plumb_bob,
/// rational_polynomial, equidistant (fisheye). The extrinsics follow from R of both and P of the right camera.
Result<LoadedRig> read_ros_calib(const std::string& left_path, const std::string& right_path);

// Two files with poses in an undocumented frame; file_frame.h explains the choice of the body.

/// mrcal .cameramodel: LENSMODEL_PINHOLE, OPENCV4, 5, 8 (12 with thin prism 0), CAHVOR, CAHVORE.
Result<LoadedRig> read_mrcal_calib(const std::string& left_path, const std::string& right_path);
/// Ames Stereo Pipeline .tsai: pinhole without distortion or with TSAI distortion. The files do not contain the image
/// size.
Result<LoadedRig> read_tsai_calib(const std::string& left_path, const std::string& right_path, ImageSize size);
/// JPL .cahv, .cahvor, .cahvore. `size` is used if a file has no Dimensions.
Result<LoadedRig> read_cahvor_calib(const std::string& left_path, const std::string& right_path, ImageSize size);

/// The path and content of a file.
struct CalibrationFile {
  std::string path, content;
};
using CalibrationFiles = std::vector<CalibrationFile>;

/// The files that represent the rig in a format; nothing is written to disk. `path` is the file, for EuRoC the folder,
/// for formats with one file per camera "LEFT,RIGHT" or one path from which two are derived. Code `configuration`,
/// naming camera and reason, if the format cannot represent a camera model or all cameras. Other information (names,
/// pixel formats, masks, pan-tilt units, a skew below 0.01 px across the image) is dropped; see describe_differences().
Result<CalibrationFiles> to_calibration_files(const Rig& rig, CalibrationFormat format, const std::string& path);
/// Writes them, with the folders they are in: all of them, or none. Code `output`.
Status write_calibration_files(const CalibrationFiles& files);

/// The rig reduced to one pair, its cameras and their mounts.
Rig rig_of_pair(const Rig& rig, const StereoPair& pair);

/// Writes the files of to_calibration_files() to a temporary folder and reads them in that format, together with
/// existing files at their destination that would be read with them: further cameras of EuRoC, the IMU of KITTI raw,
/// OpenCV's other file. Errors name the files by their destination; code `output` if no temporary folder can be
/// created.
Result<LoadedRig> read_back(const CalibrationFiles& files, CalibrationFormat format, ImageSize size);

}  // namespace spartan
