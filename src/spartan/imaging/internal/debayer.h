// Debayering (demosaicing): colour or luma from Bayer mosaics. The paper's sub-module "debayering".
#pragma once

#include <cstdint>
#include <memory>

#include "spartan/core/frame_image.h"
#include "spartan/core/image.h"
#include "spartan/core/simd.h"
#include "spartan/core/threads.h"
#include "spartan/imaging/imager.h"

namespace spartan::internal {

/// Interpolates RGB, or the luma of the same RGB, from mosaics of 8 to 16 bits. Reuses its buffers; one object may be
/// used by several threads at once. Beyond the borders the mosaic is mirrored about its outermost samples, which keeps
/// the Bayer phase. `result` has the size of `mosaic` (at least 2 × 2 px) and the same scale. Up to rounding, the
/// result does not depend on bit depth and alignment. Throws where the sizes differ, `format` is not a Bayer pattern or
/// its samples have another type.
class Debayerer {
 public:
  /// `simd`: instruction set; all give the same bits.
  explicit Debayerer(DebayerMethod method = DebayerMethod::bilinear, SimdTarget simd = SimdTarget::automatic);
  Debayerer(Debayerer&&) noexcept;
  Debayerer& operator=(Debayerer&&) noexcept;
  ~Debayerer();

  void apply(ImageView<const std::uint8_t> mosaic, const PixelFormat& format, ImageView<Rgb8> result,
             const ThreadPool& workers) const;
  void apply(ImageView<const std::uint16_t> mosaic, const PixelFormat& format, ImageView<Rgb16> result,
             const ThreadPool& workers) const;
  void apply(ImageView<const std::uint8_t> mosaic, const PixelFormat& format, ImageView<std::uint8_t> result,
             const ThreadPool& workers) const;
  void apply(ImageView<const std::uint16_t> mosaic, const PixelFormat& format, ImageView<std::uint16_t> result,
             const ThreadPool& workers) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace spartan::internal
