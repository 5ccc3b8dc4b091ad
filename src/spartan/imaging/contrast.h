// Gray levels stretched to a common range: the published sub-module "contrast".
#pragma once

#include <cstdint>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/pixel_format.h"
#include "spartan/core/threads.h"

namespace spartan {

/// How often each gray level occurs. One histogram takes both eyes of a pair, so that both are mapped alike.
class GrayHistogram {
 public:
  /// Throws where `format` has not 8 to 16 bits.
  explicit GrayHistogram(PixelFormat format);

  void clear();
  /// Samples as the format stores them (low or high alignment).
  void add(ImageView<const std::uint8_t> image);
  void add(ImageView<const std::uint16_t> image);

  /// The smallest level with more than `percent` of all samples at or below it (the largest that occurs for 100).
  int percentile(double percent) const;
  int levels() const { return static_cast<int>(counts_.size()); }

 private:
  int shift_ = 0;
  std::uint64_t total_ = 0;
  std::vector<std::uint64_t> counts_;
};

/// A table from stored samples to 8-bit gray levels. Levels from `low` to `high` go linearly to 0 … 255.
class ContrastMapping {
 public:
  /// The whole range of the format to 0 … 255; for 8 bits the identity.
  explicit ContrastMapping(PixelFormat format);

  /// Makes the percentiles black and white. A picture that fills the range already stays as it is, one of a single
  /// level is only scaled, and the range is never fewer than kLeastLevels levels: noise does not become a picture.
  void stretch(const GrayHistogram& histogram, double low_percent, double high_percent);

  std::uint8_t operator()(int stored) const { return table_[static_cast<std::size_t>(stored >> shift_)]; }
  /// `result` has the size of `image`; rows are shared among the workers.
  void apply(ImageView<const std::uint8_t> image, ImageView<std::uint8_t> result, const Workers& workers) const;
  void apply(ImageView<const std::uint16_t> image, ImageView<std::uint8_t> result, const Workers& workers) const;

  static constexpr int kLeastLevels = 16;

 private:
  void set_range(int low, int high);

  int shift_ = 0;
  std::vector<std::uint8_t> table_;  ///< indexed by the sample, shifted down to its `bits`
};

}  // namespace spartan
