// The one lookup table that undistorts and rectifies in a single step: the sub-module "rectification" at work.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "spartan/core/image.h"
#include "spartan/core/threads.h"
#include "spartan/rig/camera_model.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan {

/// For every pixel of the rectified view the place in the camera's image where its light fell, in fixed point with
/// 7 bits behind the point: off by at most 1/256 px in each direction.
class RemapTable {
 public:
  /// What the view sees of the camera. `self_mask` (0: the rover itself) has the source's size or is empty.
  /// Pixels that look past the sensor, out of the model's domain or onto the masked part are invalid.
  RemapTable(const CameraModel& camera, ImageSize source_size, const RectifiedStereo& view,
             const Eigen::Matrix3d& camera_from_rectified, ImageView<const std::uint8_t> self_mask,
             const Workers& workers);

  ImageSize size() const { return entries_.size(); }
  ImageSize source_size() const { return source_size_; }
  /// 255 where the table has a place; an empty view where it has one everywhere.
  ImageView<const std::uint8_t> mask() const { return all_valid_ ? ImageView<const std::uint8_t>() : mask_.view(); }
  /// The place of a valid pixel in the source, px.
  Eigen::Vector2d source_of(int x, int y) const;

  /// Bilinear interpolation in integers, rounded; invalid pixels become 0. Throws where sizes differ from the table's.
  void apply(ImageView<const std::uint8_t> source, ImageView<std::uint8_t> result, const Workers& workers) const;

  static constexpr int kFractionBits = 7;

 private:
  /// The pixel up and left of the place, and how far beyond it the place lies, in 1/128 px (128 at the last column).
  struct Entry {
    std::int16_t x, y;
    std::uint8_t part_x, part_y;
  };
  Entry entry_of(const Eigen::Vector2d& place) const;

  ImageSize source_size_;
  Image<Entry> entries_;
  Image<std::uint8_t> mask_;
  bool all_valid_ = true;
};

}  // namespace spartan
