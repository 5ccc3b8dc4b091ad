// Lookup table that undistorts and rectifies in one resampling step.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/simd.h"
#include "spartan/core/threads.h"
#include "spartan/imaging/internal/remap_kernels.h"
#include "spartan/rig/models/camera_model.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan::internal {

/// For every pixel of the rectified view its position in the camera image, in fixed point with 7 fraction bits (at most
/// 1/256 px of rounding error per axis). One table serves gray and colour images of 8 to 16 bits.
class RemapTable {
 public:
  /// Computes the table for a view of a camera. `self_mask` (0: the rover itself) has the size of the source or is
  /// empty. A pixel is invalid where its position is outside the sensor (by more than the rounding error of 1/256 px),
  /// outside the domain of the camera model, or touches the self-mask. `depth_m`: depth at which the table is exact,
  /// which only matters for non-central cameras. `simd`: instruction set; all give the same bits.
  RemapTable(const CameraModel& camera, ImageSize source_size, const RectifiedStereo& view,
             const Eigen::Matrix3d& camera_from_rectified, ImageView<const std::uint8_t> self_mask,
             const ThreadPool& workers, double depth_m = 1, SimdTarget simd = SimdTarget::automatic);

  ImageSize size() const { return mask_.size(); }
  ImageSize source_size() const { return source_size_; }
  /// 255 at valid pixels, else 0; empty where all pixels are valid.
  ImageView<const std::uint8_t> mask() const { return all_valid_ ? ImageView<const std::uint8_t>() : mask_.view(); }
  /// Position of a valid pixel in the source, px.
  Eigen::Vector2d source_of(int x, int y) const;
  /// Memory of the table in bytes, without the mask.
  std::size_t bytes() const;

  /// Bilinear interpolation in integers (remap::interpolate), each channel separately; invalid pixels become 0. Throws
  /// where the sizes differ from those of the table.
  void apply(ImageView<const std::uint8_t> source, ImageView<std::uint8_t> result, const ThreadPool& workers) const;
  void apply(ImageView<const std::uint16_t> source, ImageView<std::uint16_t> result, const ThreadPool& workers) const;
  void apply(ImageView<const Rgb8> source, ImageView<Rgb8> result, const ThreadPool& workers) const;
  void apply(ImageView<const Rgb16> source, ImageView<Rgb16> result, const ThreadPool& workers) const;

  static constexpr int kFractionBits = remap::kFractionBits;

 private:
  struct Entry {
    remap::SourcePixel pixel;
    std::uint8_t fraction_x, fraction_y;
    bool valid;
  };
  using CellEntries = std::array<Entry, remap::kCell>;
  /// A block whose source pixels are too far apart for a common corner and codes.
  struct Scattered {
    int x;  ///< column of its first pixel
    std::array<remap::SourcePixel, remap::kBlock> pixels;
  };

  Entry to_entry(const Eigen::Vector2d& pixel) const;
  void store_block(int x, int y, std::span<const Entry> entries);
  template <class Pixel>
  void apply_any(ImageView<const Pixel> source, ImageView<Pixel> result, const ThreadPool& workers) const;

  ImageSize source_size_;
  remap::Kernels kernels_;
  Image<remap::Cell> cells_;
  std::vector<std::vector<Scattered>> scattered_;  ///< per row, from left to right
  Image<std::uint8_t> mask_;
  bool all_valid_ = true;
};

}  // namespace spartan::internal
