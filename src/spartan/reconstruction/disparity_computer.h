// Disparity computation: the published sub-module "disparity computation".
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "spartan/core/image.h"
#include "spartan/core/options.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"

namespace spartan {

/// Which disparities are looked at: min … max, both included, in pixels.
struct DisparityRange {
  int min = 0;
  int max = 63;
  int count() const { return max - min + 1; }
};

/// Milliseconds of each step of one call (wall clock; for reports only, nothing depends on it).
struct DisparityTimes {
  double cost = 0, aggregate = 0, select = 0, refine = 0, check = 0, filter = 0, total = 0;
};

/// A disparity image of the rectified left view: x_left − x_right in pixels, NaN where unknown.
/// The view borrows the computer's buffer until its next call.
struct DisparityImage {
  ImageView<const float> disparity;
  DisparityTimes times;
  std::size_t buffer_bytes = 0;  ///< all buffers held for this image size and range
};

struct DisparityOptions;  // disparity_options.h

class DisparityComputer {
 public:
  DisparityComputer(const DisparityOptions& options, Workers workers);
  DisparityComputer(DisparityComputer&&) noexcept;
  DisparityComputer& operator=(DisparityComputer&&) noexcept;
  ~DisparityComputer();

  /// Both images of one size, rectified. Masks (255 valid) may be empty. Codes as check().
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
