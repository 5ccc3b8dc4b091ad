// Coloured point clouds from disparity images, and their PLY files.
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

/// Triangulates every `step_px`-th pixel of every `step_px`-th row with a known disparity of at least
/// `smallest_disparity_px` and transforms it by `target_from_left`. The colour is the gray level of the left image.
PointCloud to_point_cloud(ImageView<const float> disparity, ImageView<const std::uint8_t> left,
                          const RectifiedStereo& geometry, const Pose& target_from_left, int step_px,
                          double smallest_disparity_px);

/// Writes a binary little-endian PLY file with float x, y, z and uchar red, green, blue. Code `output`.
Status write_ply(const std::string& path, const PointCloud& cloud);
/// Reads files of write_ply() only. Code `input`.
Result<PointCloud> read_ply(const std::string& path);

}  // namespace spartan
