// Dense stereo matching: from a rectified image pair to a disparity image.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "spartan/core/image.h"
#include "spartan/core/options.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"

namespace spartan {

/// The disparities that are searched: min … max, both included, in whole pixels.
struct DisparityRange {
  int min = 0;
  int max = 63;
  int count() const { return max - min + 1; }
};

/// Wall-clock milliseconds of each step of one call; for reports only, no result depends on them.
struct DisparityTimes {
  double cost = 0, aggregate = 0, select = 0, refine = 0, check = 0, filter = 0, total = 0;
};

/// A disparity image of the rectified left camera: x_left − x_right in pixels, NaN where unknown.
/// The view borrows the computer's buffer and is valid until its next call.
struct DisparityImage {
  ImageView<const float> disparity;
  DisparityTimes times;
  std::size_t buffer_bytes = 0;  ///< Bytes of all buffers held for this image size and search range.
};

struct DisparityOptions;  // disparity_options.h

/// Dense disparities by census matching (Zabih & Woodfill 1994) and semi-global matching (Hirschmüller 2008), followed
/// by a left-right consistency check, masks, a median filter and a speckle filter. Derivation: docs/math/stereo.md. The
/// result is the same, bit for bit, for any number of threads and on every SIMD instruction set.
class DisparityComputer {
 public:
  DisparityComputer(const DisparityOptions& options, ThreadPool workers);
  DisparityComputer(DisparityComputer&&) noexcept;
  DisparityComputer& operator=(DisparityComputer&&) noexcept;
  ~DisparityComputer();

  /// Both images must be rectified and of one size. Masks (255: valid, 0: excluded) may be empty. Codes as check().
  Result<DisparityImage> compute(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right,
                                 DisparityRange range, ImageView<const std::uint8_t> left_mask = {},
                                 ImageView<const std::uint8_t> right_mask = {});

  /// What compute() needs of its input, without computing: where this is well, compute() does not fail. Code
  /// `frame_rejected` where sizes differ or the range is empty or wider than the image.
  static Status check(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right, DisparityRange range,
                      ImageView<const std::uint8_t> left_mask = {}, ImageView<const std::uint8_t> right_mask = {});

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace spartan
