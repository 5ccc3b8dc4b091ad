// Vignetting correction.
#pragma once

#include <cstdint>

#include "spartan/core/image.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/rig/rig.h"

namespace spartan::internal {

/// Multiplies what each pixel has above the black level of the camera (CameraDriver::black_level, else 0) by
/// 1 / Vignetting::relative_illumination, in fixed point with 13 fraction bits.
class VignettingCorrection {
 public:
  /// Code `configuration` where the relative illumination of a pixel is not between Vignetting::kMinIllumination and
  /// 2¹³.
  static Result<VignettingCorrection> create(const Camera& camera, const ThreadPool& workers);

  /// Results are rounded and saturate at the full scale of the camera's pixel format. `result` may be `image`. Throws
  /// where the sizes differ from the camera's.
  void apply(ImageView<const std::uint8_t> image, ImageView<std::uint8_t> result, const ThreadPool& workers) const;
  void apply(ImageView<const std::uint16_t> image, ImageView<std::uint16_t> result, const ThreadPool& workers) const;

  static constexpr int kFractionBits = 13;

 private:
  VignettingCorrection(Image<std::uint16_t> factors, int full_scale, int black_level)
      : factors_(std::move(factors)), full_scale_(full_scale), black_level_(black_level) {}
  template <class T>
  void apply_any(ImageView<const T> image, ImageView<T> result, const ThreadPool& workers) const;

  Image<std::uint16_t> factors_;
  int full_scale_, black_level_;
};

}  // namespace spartan::internal
