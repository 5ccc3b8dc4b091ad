// Gray levels stretched to a common range: the published sub-module "contrast".
#pragma once

#include <cstdint>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/pixel_format.h"
#include "spartan/core/threads.h"

namespace spartan {

/// How often each gray level occurs. The sum of both eyes' histograms maps both alike.
class GrayHistogram {
 public:
  /// Throws where `format` has not 8 to 16 bits.
  explicit GrayHistogram(PixelFormat format);

  void clear();
  /// Samples as the format stores them (low or high alignment), where `mask` (of the image's size, or empty) is not 0.
  /// Throws where the sizes differ.
  void add(ImageView<const std::uint8_t> image, ImageView<const std::uint8_t> mask = {});
  void add(ImageView<const std::uint16_t> image, ImageView<const std::uint8_t> mask = {});

  /// All samples of another histogram of the same depth, their levels times `gain`.
  void add(const GrayHistogram& other, double gain);

  /// The smallest level with more than `percent` of all samples at or below it (the largest that occurs for 100).
  int percentile(double percent) const;
  /// The same between the levels: a level's samples fill the interval of half a level to either side evenly.
  double quantile(double percent) const;
  bool empty() const { return total_ == 0; }
  int levels() const { return static_cast<int>(counts_.size()); }

 private:
  int shift_ = 0;
  std::uint64_t total_ = 0;
  std::vector<std::uint64_t> counts_;
};

/// How much brighter the left eye is: the median, over the percentiles 10 … 90, of the left level over the right one.
/// Both eyes see the same ground but for strips at the sides, so their histograms differ by exposure and gain above
/// all; the strips make it some percent wrong (docs/results.md). 1 where the levels are too few or too low to tell.
/// Histograms of the same depth.
double brightness_ratio(const GrayHistogram& left, const GrayHistogram& right);

/// By what factor the right eye's gray levels are to be multiplied to be as bright as the left one's. With the ratio
/// 1 + r (or its inverse, whichever is larger) it is 1 + r − 0.05²/r, and 1 where r < 0.05: what may come from the
/// strips is not believed, and there is no jump between frames whose ratios are alike (the non-negative garrote:
/// Breiman, "Better subset regression using the nonnegative garrote", Technometrics 1995). Never outside ½ … 2.
double gain_between(const GrayHistogram& left, const GrayHistogram& right);

/// A table from stored samples to 8-bit gray levels. Levels from `low` to `high` go linearly to 0 … 255.
class ContrastMapping {
 public:
  /// The whole range of the format to 0 … 255; for 8 bits the identity.
  explicit ContrastMapping(PixelFormat format);

  /// Makes the percentiles black and white; an empty histogram only scales. A picture that fills the range already
  /// stays as it is, and the range is never less than a sixteenth of the format's, with the percentiles in its middle:
  /// noise does not become a picture.
  void stretch(const GrayHistogram& histogram, double low_percent, double high_percent);

  /// What `other` does, of samples that are multiplied by `gain` first.
  void follow(const ContrastMapping& other, double gain);

  std::uint8_t operator()(int stored) const { return table_[static_cast<std::size_t>(stored >> shift_)]; }
  /// `result` has the size of `image`; rows are shared among the workers.
  void apply(ImageView<const std::uint8_t> image, ImageView<std::uint8_t> result, const Workers& workers) const;
  void apply(ImageView<const std::uint16_t> image, ImageView<std::uint8_t> result, const Workers& workers) const;

 private:
  void set_range(int low, int high, double gain = 1);

  int shift_ = 0;
  int low_ = 0, high_ = 0;
  std::vector<std::uint8_t> table_;  ///< indexed by the sample, shifted down to its `bits`
};

}  // namespace spartan
