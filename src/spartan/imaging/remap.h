// The one lookup table that undistorts and rectifies in a single step: the sub-module "rectification" at work.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/threads.h"
#include "spartan/imaging/remap_kernels.h"
#include "spartan/rig/models/camera_model.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan {

/// For every pixel of the rectified view the place in the camera's image where its light fell, in fixed point with
/// 7 bits behind the point: off by at most 1/256 px in each direction. One table serves gray and colour of 8 to 16
/// bits.
class RemapTable {
 public:
  /// What the view sees of the camera. `self_mask` (0: the rover itself) has the source's size or is empty.
  /// Pixels that look past the sensor (by more than the 1/256 px that places are rounded by), out of the model's domain
  /// or onto the masked part are invalid. `depth_m`: of the surface for which the table is right; only cameras whose
  /// rays do not meet in one point care. `simd`: see simd_target_index(); the result is the same, bit for bit.
  RemapTable(const CameraModel& camera, ImageSize source_size, const RectifiedStereo& view,
             const Eigen::Matrix3d& camera_from_rectified, ImageView<const std::uint8_t> self_mask,
             const Workers& workers, double depth_m = 1, const std::string& simd = "auto");

  ImageSize size() const { return mask_.size(); }
  ImageSize source_size() const { return source_size_; }
  /// 255 where the table has a place; an empty view where it has one everywhere.
  ImageView<const std::uint8_t> mask() const { return all_valid_ ? ImageView<const std::uint8_t>() : mask_.view(); }
  /// The place of a valid pixel in the source, px.
  Eigen::Vector2d source_of(int x, int y) const;
  /// The table's own memory, without the mask.
  std::size_t bytes() const;

  /// Bilinear interpolation in integers (remap::interpolate), each channel for itself; invalid pixels become 0. Throws
  /// where sizes differ from the table's.
  void apply(ImageView<const std::uint8_t> source, ImageView<std::uint8_t> result, const Workers& workers) const;
  void apply(ImageView<const std::uint16_t> source, ImageView<std::uint16_t> result, const Workers& workers) const;
  void apply(ImageView<const Rgb8> source, ImageView<Rgb8> result, const Workers& workers) const;
  void apply(ImageView<const Rgb16> source, ImageView<Rgb16> result, const Workers& workers) const;

  static constexpr int kFractionBits = remap::kFractionBits;

 private:
  struct Entry {
    remap::Place place;
    std::uint8_t part_x, part_y;
    bool seen;
  };
  using CellEntries = std::array<Entry, remap::kCell>;
  /// A block whose pixels look too far apart for a corner and codes.
  struct Scattered {
    int x;  ///< of its first pixel
    std::array<remap::Place, remap::kBlock> places;
  };

  Entry entry_of(const Eigen::Vector2d& place) const;
  void store_block(int x, int y, std::span<const Entry> entries);
  template <class Pixel>
  void apply_any(ImageView<const Pixel> source, ImageView<Pixel> result, const Workers& workers) const;

  ImageSize source_size_;
  remap::Kernels kernels_;
  Image<remap::Cell> cells_;
  std::vector<std::vector<Scattered>> scattered_;  ///< of each row, from left to right
  Image<std::uint8_t> mask_;
  bool all_valid_ = true;
};

}  // namespace spartan
