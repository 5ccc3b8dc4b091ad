// Readers that also report ignored information; those in calibration_files.h return the rig alone.
#pragma once

#include "spartan/calibration_io/calibration_files.h"

namespace spartan::internal {

/// `LoadedRig::body` of a rig whose files define no body frame.
constexpr const char* kBodyIsLeftCamera = "the left camera, turned to x forward, y left, z up";

Result<LoadedRig> read_kitti(const std::string& path, ImageSize size, KittiPair pair = KittiPair::gray);
Result<LoadedRig> read_kitti_raw(const std::string& path, KittiPair pair = KittiPair::gray);
Result<LoadedRig> read_opencv(const std::string& intrinsics_path, const std::string& extrinsics_path, ImageSize size);

/// Returns the rig of a LoadedRig.
Result<Rig> rig_of(Result<LoadedRig> read);

}  // namespace spartan::internal
