#include "spartan/rig/rig_writing.h"

#include <fmt/format.h>

#include <algorithm>

#include "spartan/rig/calibration_writers.h"
#include "spartan/rig/rig_files.h"

namespace spartan {

namespace rig_detail {

tl::unexpected<Error> cannot_hold(const Camera& camera, const std::string& why) {
  return failure(ErrorCode::configuration, why, "cameras." + camera.name);
}

Result<Eyes> only_pair(const Rig& rig, CalibrationFormat format) {
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
                   "cameras." + camera.name, "leave it out with --pair " + pair.name);
  }
  return Eyes{rig.find_camera(pair.left), rig.find_camera(pair.right), &pair};
}

std::vector<const Camera*> pair_first(const Rig& rig) {
  const StereoPair& pair = rig.pairs.front();
  std::vector<const Camera*> cameras{rig.find_camera(pair.left), rig.find_camera(pair.right)};
  for (const Camera& camera : rig.cameras) {
    if (camera.name != pair.left && camera.name != pair.right) cameras.push_back(&camera);
  }
  return cameras;
}

}  // namespace rig_detail

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
  if (Status sound = rig.validate("the rig"); !sound) return failure(std::move(sound));
  switch (format) {
    case CalibrationFormat::rig_yaml:
      return CalibrationFiles{{path, to_rig_yaml(rig)}};
    case CalibrationFormat::kitti:
      return rig_detail::write_kitti_calib(rig, path);
    case CalibrationFormat::kitti_raw:
      return rig_detail::write_kitti_raw_calib(rig, path);
    case CalibrationFormat::euroc:
      return rig_detail::write_euroc_calib(rig, path);
    case CalibrationFormat::kalibr:
      return rig_detail::write_kalibr_calib(rig, path);
    case CalibrationFormat::opencv:
      return rig_detail::write_opencv_calib(rig, path);
    case CalibrationFormat::ros:
      return rig_detail::write_ros_calib(rig, path);
    case CalibrationFormat::mrcal:
      return rig_detail::write_mrcal_calib(rig, path);
    case CalibrationFormat::tsai:
      return rig_detail::write_tsai_calib(rig, path);
    case CalibrationFormat::cahvor:
      return rig_detail::write_cahvor_calib(rig, path);
  }
  return failure(ErrorCode::internal, "an unknown format");
}

}  // namespace spartan
