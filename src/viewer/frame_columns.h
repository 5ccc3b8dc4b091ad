// The records of frames as columns of JSON, for plots.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "spartan/system/run_store.h"

namespace spartan::viewer {

/// An object with an array for each quantity, of the frames from number `from` on; null where it is not known:
///   t_s since the first frame, stamp_ns (text), status, message; inliers, matches, landmarks, rms_px;
///   pose [x, y, z, qx, qy, qz, qw] of the best trajectory, sigma_m (along x, y, z of the world), ellipse_m2 (covariance
///   xx, xy, yy of the position); odometry, slam, localization, smoothed: [x, y, z];
///   stages: {name: [ms]}; sensors: {name: [state]}.
std::string frame_columns(const std::vector<FrameRecord>& frames, std::size_t from);

}  // namespace spartan::viewer
