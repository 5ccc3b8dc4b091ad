// Gain compensation and linear contrast stretch, the same for both images. The paper's sub-module "contrast".
#pragma once

#include <cstdint>
#include <vector>

#include "spartan/core/frame_image.h"
#include "spartan/core/image.h"
#include "spartan/core/threads.h"

namespace spartan::internal {

/// Histogram of gray levels. The sum of the left and right histogram determines the common mapping.
class GrayHistogram {
 public:
  /// Throws where `format` does not have 8 to 16 bits.
  explicit GrayHistogram(PixelFormat format);

  void clear();
  /// Adds the samples, stored as in the format (low or high alignment), where `mask` (of the image's size, or empty) is
  /// not 0. Throws where the sizes differ.
  void add(ImageView<const std::uint8_t> image, ImageView<const std::uint8_t> mask = {});
  void add(ImageView<const std::uint16_t> image, ImageView<const std::uint8_t> mask = {});

  /// Adds another histogram of the same depth with its levels multiplied by `gain`.
  void add(const GrayHistogram& other, double gain);

  /// The smallest level with more than `percent` % of all samples at or below it (for 100 the largest level present).
  int percentile(double percent) const;
  /// The same, interpolated: the samples of a level are uniformly distributed within ±½ level.
  double quantile(double percent) const;
  bool empty() const { return total_ == 0; }
  int levels() const { return static_cast<int>(counts_.size()); }

 private:
  int shift_ = 0;
  std::uint64_t total_ = 0;
  std::vector<std::uint64_t> counts_;
};

/// Ratio of left to right brightness: the median of left level / right level over the percentiles 10, 15 … 90. Both
/// cameras see the same ground except for strips at the sides, so their histograms differ mostly by exposure and gain;
/// the strips cause an error of some percent (docs/benchmarks/imaging.md). 1 where fewer than five percentiles are
/// usable (too dark or saturated). Both histograms must have the same depth.
double brightness_ratio(const GrayHistogram& left, const GrayHistogram& right);

/// Gain for the gray levels of the right image that matches the brightness of the left image. With the brightness ratio
/// 1 + r (or its inverse, whichever is larger) the gain is 1 + r − 0.05²/r, and 1 for r ≤ 0.05. Small ratios may come
/// from the strips that only one camera sees; the shrinkage is continuous, so the gain does not jump between similar
/// frames (non-negative garrote: Breiman, "Better subset regression using the nonnegative garrote", Technometrics
/// 1995). Limited to ½ … 2.
double gain_between(const GrayHistogram& left, const GrayHistogram& right);

/// Lookup table from stored samples to 8-bit gray levels: linear from a level range to 0 … 255.
class ContrastMapping {
 public:
  /// Maps the full range of the format to 0 … 255; for 8 bits the identity.
  explicit ContrastMapping(PixelFormat format);

  /// Maps the two percentiles to black and white; an empty histogram maps the full range. The input range is at least
  /// 1/16 of the range of the format (and 16 levels), centred on the percentiles, so that noise of a flat image is not
  /// amplified.
  void stretch(const GrayHistogram& histogram, double low_percent, double high_percent);

  /// Takes the range of `other`, for samples that are multiplied by `gain` first.
  void copy_with_gain(const ContrastMapping& other, double gain);

  std::uint8_t operator()(int stored) const { return table_[static_cast<std::size_t>(stored >> shift_)]; }
  /// Maps an image; `result` has its size. Rows are distributed over the workers.
  void apply(ImageView<const std::uint8_t> image, ImageView<std::uint8_t> result, const ThreadPool& workers) const;
  void apply(ImageView<const std::uint16_t> image, ImageView<std::uint8_t> result, const ThreadPool& workers) const;

 private:
  void set_range(int low, int high, double gain = 1);

  int shift_ = 0;
  int low_ = 0, high_ = 0;
  std::vector<std::uint8_t> table_;  ///< indexed by the sample, shifted down to its significant bits
};

}  // namespace spartan::internal
