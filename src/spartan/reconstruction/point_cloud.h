// Coloured points from a disparity image, and their PLY files.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan {

struct ColouredPoint {
  Eigen::Vector3f position;  ///< m
  Rgb8 colour;
};
using PointCloud = std::vector<ColouredPoint>;

/// Every `step_px`-th known pixel of every `step_px`-th row whose disparity is at least `smallest_disparity_px`, moved
/// by `target_from_left`. Gray levels of the left image become the colour.
PointCloud to_point_cloud(ImageView<const float> disparity, ImageView<const std::uint8_t> left,
                          const RectifiedStereo& geometry, const Pose& target_from_left, int step_px,
                          double smallest_disparity_px);

/// Binary little-endian PLY with float x, y, z and uchar red, green, blue. Code `output`.
Status write_ply(const std::string& path, const PointCloud& cloud);
/// Reads what write_ply() wrote; nothing else. Code `input`.
Result<PointCloud> read_ply(const std::string& path);

}  // namespace spartan
