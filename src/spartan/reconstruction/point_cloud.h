// Coloured point clouds from disparity images, and their files.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/core/time.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan {

struct ColouredPoint {
  Eigen::Vector3f position;  ///< m
  Rgb8 colour;
  float sigma_m = 0;  ///< standard deviation of the range, or, of a map cell, of the elevation
  double time_s = 0;  ///< of the image, in the clock of the recording
};
using PointCloud = std::vector<ColouredPoint>;

/// Which pixels of a disparity image become points.
struct CloudSampling {
  int step_px = 1;  ///< every step_px-th pixel of every step_px-th row
  double min_disparity_px = 0.5;
  double max_range_m = 0;  ///< distance from the left camera; 0: no limit
};

/// Triangulates pixels with a known disparity and transforms the points by `target_from_left`. `sigma`: standard
/// deviations σ_d of the disparities, px; pixels without one are left out, as they were filled. The colour is the gray
/// level of the left image; σ of the range is z² σ_d / (f b) times the ratio of range and depth.
PointCloud to_point_cloud(ImageView<const float> disparity, ImageView<const float> sigma,
                          ImageView<const std::uint8_t> left, const RectifiedStereo& geometry,
                          const Pose& target_from_left, const Stamp& stamp, const CloudSampling& sampling);

/// Writes a binary little-endian PLY file with float x, y, z, uchar red, green, blue, float sigma_m and double time_s.
/// Code `output`.
Status write_ply(const std::string& path, const PointCloud& cloud);
/// Reads files of write_ply() only; those of version 0.1 have neither sigma_m nor time_s. Code `input`.
Result<PointCloud> read_ply(const std::string& path);

/// Writes a binary PCD file of version 0.7 with the fields x, y, z, rgb (the bits of a float, as PCL packs it), sigma_m
/// and time_s (double). Code `output`.
Status write_pcd(const std::string& path, const PointCloud& cloud);

}  // namespace spartan
