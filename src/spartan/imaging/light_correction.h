// Undoes the fall-off of light towards the edge of the image.
#pragma once

#include <cstdint>

#include "spartan/core/image.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/rig/rig.h"

namespace spartan {

/// One factor a pixel, 1 / Vignetting::light_at, in fixed point with 13 bits behind the point. Black is taken to be 0.
class LightCorrection {
 public:
  /// Code `configuration` where some pixel gets less than Vignetting::kLeast of the light.
  static Result<LightCorrection> create(const Camera& camera, const Workers& workers);

  /// Rounded; what leaves the scale of the camera's pixel format becomes its largest value. `result` may be `image`.
  /// Throws where sizes differ from the camera's.
  void apply(ImageView<const std::uint8_t> image, ImageView<std::uint8_t> result, const Workers& workers) const;
  void apply(ImageView<const std::uint16_t> image, ImageView<std::uint16_t> result, const Workers& workers) const;

  static constexpr int kFractionBits = 13;

 private:
  LightCorrection(Image<std::uint16_t> factors, int full_scale)
      : factors_(std::move(factors)), full_scale_(full_scale) {}
  template <class T>
  void apply_any(ImageView<const T> image, ImageView<T> result, const Workers& workers) const;

  Image<std::uint16_t> factors_;
  int full_scale_;
};

}  // namespace spartan
