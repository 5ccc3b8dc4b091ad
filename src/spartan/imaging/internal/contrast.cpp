#include "spartan/imaging/internal/contrast.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace spartan::internal {
namespace {

constexpr int kTableRowsPerPart = 64;  // rows per task; does not affect results

int levels_of(PixelFormat format) {
  if (format.bits < 8 || format.bits > 16) throw std::invalid_argument("contrast: samples must have 8 to 16 bits");
  return 1 << format.bits;
}

int shift_of(PixelFormat format) {
  return format.bits > 8 && format.alignment == BitAlignment::high ? 16 - format.bits : 0;
}

template <class T>
void map_rows(ImageView<const T> image, ImageView<std::uint8_t> result, const ThreadPool& workers,
              const std::vector<std::uint8_t>& table, int shift) {
  if (image.size() != result.size()) throw std::invalid_argument("contrast: the sizes differ");
  // Stray bits above the significant ones must not index beyond the table.
  const unsigned last = static_cast<unsigned>(table.size()) - 1;
  workers.parallel_for(0, image.height(), kTableRowsPerPart, [&](int begin, int end) {
    for (int y = begin; y < end; ++y) {
      const T* in = image.row(y);
      std::uint8_t* out = result.row(y);
      for (int x = 0; x < image.width(); ++x) out[x] = table[std::min<unsigned>(in[x] >> shift, last)];
    }
  });
}

/// Adds the samples inside the mask to `counts`; returns their number.
template <class T>
std::uint64_t count_rows(ImageView<const T> image, ImageView<const std::uint8_t> mask,
                         std::vector<std::uint64_t>& counts, int shift) {
  if (!mask.empty() && mask.size() != image.size()) throw std::invalid_argument("contrast: the mask has another size");
  const unsigned last = static_cast<unsigned>(counts.size()) - 1;
  std::uint64_t count = 0;
  for (int y = 0; y < image.height(); ++y) {
    const T* const in = image.row(y);
    const std::uint8_t* const included = mask.empty() ? nullptr : mask.row(y);
    for (int x = 0; x < image.width(); ++x) {
      if (included != nullptr && included[x] == 0) continue;
      ++counts[std::min<unsigned>(in[x] >> shift, last)];
      ++count;
    }
  }
  return count;
}

}  // namespace

GrayHistogram::GrayHistogram(PixelFormat format)
    : shift_(shift_of(format)), counts_(static_cast<std::size_t>(levels_of(format))) {}

void GrayHistogram::clear() {
  std::fill(counts_.begin(), counts_.end(), 0);
  total_ = 0;
}

void GrayHistogram::add(ImageView<const std::uint8_t> image, ImageView<const std::uint8_t> mask) {
  total_ += count_rows(image, mask, counts_, shift_);
}

void GrayHistogram::add(ImageView<const std::uint16_t> image, ImageView<const std::uint8_t> mask) {
  total_ += count_rows(image, mask, counts_, shift_);
}

void GrayHistogram::add(const GrayHistogram& other, double gain) {
  if (other.counts_.size() != counts_.size()) throw std::invalid_argument("contrast: the histogram has another depth");
  const double last = static_cast<double>(counts_.size() - 1);
  for (std::size_t level = 0; level < counts_.size(); ++level) {
    const double scaled = std::min(static_cast<double>(level) * gain, last);
    counts_[static_cast<std::size_t>(std::lround(scaled))] += other.counts_[level];
  }
  total_ += other.total_;
}

double GrayHistogram::quantile(double percent) const {
  const double wanted = static_cast<double>(total_) * percent / 100;
  double below = 0;
  for (std::size_t level = 0; level < counts_.size(); ++level) {
    const auto count = static_cast<double>(counts_[level]);
    if (count > 0 && below + count >= wanted) return static_cast<double>(level) - 0.5 + (wanted - below) / count;
    below += count;
  }
  return 0;
}

double brightness_ratio(const GrayHistogram& left, const GrayHistogram& right) {
  // Below 1/32 of full scale the unknown black level dominates the ratio; the highest level is saturated.
  const double least = left.levels() / 32.0, most = left.levels() - 1.5;
  std::vector<double> ratios;
  ratios.reserve(17);
  for (int percent = 10; percent <= 90; percent += 5) {
    const double l = left.quantile(percent), r = right.quantile(percent);
    if (l >= least && r >= least && l < most && r < most) ratios.push_back(l / r);
  }
  if (ratios.size() < 5) return 1;
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  return *middle;
}

double gain_between(const GrayHistogram& left, const GrayHistogram& right) {
  // The ratio error caused by strips that only one camera sees; measured up to 6 % (docs/math/imaging.md).
  constexpr double kDeadband = 0.05;
  const double ratio = brightness_ratio(left, right);
  const double difference = std::max(ratio, 1 / ratio) - 1;
  if (difference <= kDeadband) return 1;
  const double gain = std::min(1 + difference - kDeadband * kDeadband / difference, 2.0);
  return ratio > 1 ? gain : 1 / gain;
}

int GrayHistogram::percentile(double percent) const {
  const double wanted = static_cast<double>(total_) * percent / 100;
  std::uint64_t below = 0;
  int largest = 0;
  for (int level = 0; level < levels(); ++level) {
    const std::uint64_t count = counts_[static_cast<std::size_t>(level)];
    if (count == 0) continue;
    largest = level;
    below += count;
    if (static_cast<double>(below) > wanted) return level;
  }
  return largest;
}

ContrastMapping::ContrastMapping(PixelFormat format)
    : shift_(shift_of(format)), table_(static_cast<std::size_t>(levels_of(format))) {
  set_range(0, static_cast<int>(table_.size()) - 1);
}

void ContrastMapping::stretch(const GrayHistogram& histogram, double low_percent, double high_percent) {
  const int last = static_cast<int>(table_.size()) - 1;
  if (histogram.levels() != last + 1) throw std::invalid_argument("contrast: the histogram has another depth");
  if (histogram.empty()) return set_range(0, last);
  int low = histogram.percentile(low_percent);
  int high = std::max(histogram.percentile(high_percent), low);
  const int least = std::max(16, histogram.levels() / 16);  // smallest range, so that noise is not amplified
  if (high - low < least) {
    low = std::clamp((low + high - least) / 2, 0, last - least);
    high = low + least;
  }
  set_range(low, high);
}

void ContrastMapping::copy_with_gain(const ContrastMapping& other, double gain) {
  if (other.table_.size() != table_.size()) throw std::invalid_argument("contrast: the mapping has another depth");
  set_range(other.low_, other.high_, gain);
}

void ContrastMapping::set_range(int low, int high, double gain) {
  // Computed in 1/256 level, so that rounding by the gain is negligible before the final rounding.
  constexpr int kUnit = 256;
  low_ = low;
  high_ = high;
  const std::int64_t span = std::int64_t{kUnit} * (high - low);
  for (std::size_t level = 0; level < table_.size(); ++level) {
    const auto whole = static_cast<std::int64_t>(level) * kUnit;
    const std::int64_t scaled = gain == 1 ? whole : std::llround(static_cast<double>(whole) * gain);
    const std::int64_t inside = std::clamp<std::int64_t>(scaled - std::int64_t{kUnit} * low, 0, span);
    table_[level] = static_cast<std::uint8_t>((255 * inside + span / 2) / span);
  }
}

void ContrastMapping::apply(ImageView<const std::uint8_t> image, ImageView<std::uint8_t> result,
                            const ThreadPool& workers) const {
  map_rows(image, result, workers, table_, shift_);
}

void ContrastMapping::apply(ImageView<const std::uint16_t> image, ImageView<std::uint8_t> result,
                            const ThreadPool& workers) const {
  map_rows(image, result, workers, table_, shift_);
}

}  // namespace spartan::internal
