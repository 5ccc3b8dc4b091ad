// Calibration files: the native rig.yaml, and what other projects use.
#pragma once

#include <string>

#include "spartan/core/result.h"
#include "spartan/rig/rig.h"

namespace spartan {

/// Every reader gives a validated rig, or an error of code `configuration` that names file, line or key:
/// missing keys, values that are not finite, matrices that are no rotations, wrong counts of numbers.

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

/// EuRoC/ASL: `mav0/cam0/sensor.yaml`, `mav0/cam1/sensor.yaml`; body is the body frame of T_BS.
Result<Rig> read_euroc_calib(const std::string& mav0_folder);

/// OpenCV stereo yml/xml: M1 D1 M2 D2 R T (also K1/K2, cameraMatrix1…), in one file or in an intrinsics and an
/// extrinsics file. `size` counts where the file has no image_width/image_height or image_size.
Result<Rig> read_opencv_calib(const std::string& intrinsics_path, const std::string& extrinsics_path, ImageSize size);

/// Guesses the format from name and content. `size_hint` for formats that do not hold the image size.
Result<Rig> read_rig(const std::string& path, ImageSize size_hint = {});

}  // namespace spartan
