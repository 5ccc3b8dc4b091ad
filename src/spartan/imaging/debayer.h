// Colour out of Bayer mosaics: the published sub-module "debayering".
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "spartan/core/image.h"
#include "spartan/core/pixel_format.h"
#include "spartan/core/threads.h"

namespace spartan {

enum class DebayerMethod : std::uint8_t {
  /// A missing colour is the rounded mean of its two or four nearest samples.
  bilinear,
  /// Green minus red or blue is interpolated along rows and along columns and mixed by how little it changes to either
  /// side (docs/math/imaging.md); red and blue follow from green along the straighter of two directions.
  edge_aware,
};

/// Makes colours, or the luma of the same colours, of mosaics of 8 to 16 bits. Keeps the memory that it works in; one
/// object may serve several threads at once. At the borders the mosaic is mirrored about its outermost samples, which
/// keeps its phase. `result` has the size of `mosaic` (at least 2 × 2) and the same scale. A mosaic of any depth and
/// alignment gives the same picture, but for rounding. Throws where sizes differ, `format` is no Bayer pattern or has
/// samples of another kind.
class Debayerer {
 public:
  /// `simd`: see simd_target_index(); the result is the same, bit for bit.
  explicit Debayerer(DebayerMethod method = DebayerMethod::bilinear, const std::string& simd = "auto");
  Debayerer(Debayerer&&) noexcept;
  Debayerer& operator=(Debayerer&&) noexcept;
  ~Debayerer();

  void apply(ImageView<const std::uint8_t> mosaic, const PixelFormat& format, ImageView<Rgb8> result,
             const Workers& workers) const;
  void apply(ImageView<const std::uint16_t> mosaic, const PixelFormat& format, ImageView<Rgb16> result,
             const Workers& workers) const;
  void apply(ImageView<const std::uint8_t> mosaic, const PixelFormat& format, ImageView<std::uint8_t> result,
             const Workers& workers) const;
  void apply(ImageView<const std::uint16_t> mosaic, const PixelFormat& format, ImageView<std::uint16_t> result,
             const Workers& workers) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace spartan
