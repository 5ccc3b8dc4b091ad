// One writer a format; rig_writing.h chooses. Internal to rig.
#pragma once

#include "spartan/rig/formats/rig_writing.h"

namespace spartan::rig_detail {

Result<CalibrationFiles> write_kitti_calib(const Rig& rig, const std::string& path);
Result<CalibrationFiles> write_kitti_raw_calib(const Rig& rig, const std::string& path);
Result<CalibrationFiles> write_euroc_calib(const Rig& rig, const std::string& folder);
Result<CalibrationFiles> write_kalibr_calib(const Rig& rig, const std::string& path);
Result<CalibrationFiles> write_opencv_calib(const Rig& rig, const std::string& path);
Result<CalibrationFiles> write_ros_calib(const Rig& rig, const std::string& path);
Result<CalibrationFiles> write_mrcal_calib(const Rig& rig, const std::string& path);
Result<CalibrationFiles> write_tsai_calib(const Rig& rig, const std::string& path);
Result<CalibrationFiles> write_cahvor_calib(const Rig& rig, const std::string& path);

/// The eyes of a rig that is one pair and nothing else.
struct Eyes {
  const Camera *left, *right;
  const StereoPair* pair;
};
/// Code `configuration` where the rig has further cameras or pairs; `format` is named in it.
Result<Eyes> only_pair(const Rig& rig, CalibrationFormat format);

/// The cameras with those of the first pair in front.
std::vector<const Camera*> pair_first(const Rig& rig);

/// "cameras.left: KITTI holds rectified pinholes only, this camera is equidistant".
tl::unexpected<Error> cannot_hold(const Camera& camera, const std::string& why);

}  // namespace spartan::rig_detail
