#include "spartan/imaging/contrast.h"

#include <algorithm>
#include <stdexcept>

namespace spartan {
namespace {

constexpr int kRowsPerPart = 64;

int levels_of(PixelFormat format) {
  if (format.bits < 8 || format.bits > 16) throw std::invalid_argument("contrast: 8 to 16 bits a sample");
  return 1 << format.bits;
}

int shift_of(PixelFormat format) {
  return format.bits > 8 && format.alignment == BitAlignment::high ? 16 - format.bits : 0;
}

template <class T>
void map_rows(ImageView<const T> image, ImageView<std::uint8_t> result, const Workers& workers,
              const std::vector<std::uint8_t>& table, int shift) {
  if (image.size() != result.size()) throw std::invalid_argument("contrast: the sizes differ");
  // Stray bits above those that carry signal must not lead out of the table.
  const unsigned last = static_cast<unsigned>(table.size()) - 1;
  workers.for_each_part(0, image.height(), kRowsPerPart, [&](int begin, int end) {
    for (int y = begin; y < end; ++y) {
      const T* in = image.row(y);
      std::uint8_t* out = result.row(y);
      for (int x = 0; x < image.width(); ++x) out[x] = table[std::min<unsigned>(in[x] >> shift, last)];
    }
  });
}

template <class T>
void count_rows(ImageView<const T> image, std::vector<std::uint64_t>& counts, int shift) {
  const unsigned last = static_cast<unsigned>(counts.size()) - 1;
  for (int y = 0; y < image.height(); ++y) {
    const T* in = image.row(y);
    for (int x = 0; x < image.width(); ++x) ++counts[std::min<unsigned>(in[x] >> shift, last)];
  }
}

std::uint64_t area(ImageSize size) {
  return static_cast<std::uint64_t>(size.width) * static_cast<std::uint64_t>(size.height);
}

}  // namespace

GrayHistogram::GrayHistogram(PixelFormat format)
    : shift_(shift_of(format)), counts_(static_cast<std::size_t>(levels_of(format))) {}

void GrayHistogram::clear() {
  std::fill(counts_.begin(), counts_.end(), 0);
  total_ = 0;
}

void GrayHistogram::add(ImageView<const std::uint8_t> image) {
  count_rows(image, counts_, shift_);
  total_ += area(image.size());
}

void GrayHistogram::add(ImageView<const std::uint16_t> image) {
  count_rows(image, counts_, shift_);
  total_ += area(image.size());
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
  int low = histogram.percentile(low_percent);
  int high = std::max(histogram.percentile(high_percent), low);
  if (low == high) return set_range(0, last);
  if (high - low < kLeastLevels) {
    low = std::clamp((low + high - kLeastLevels) / 2, 0, last - kLeastLevels);
    high = low + kLeastLevels;
  }
  set_range(low, high);
}

void ContrastMapping::set_range(int low, int high) {
  const int span = high - low;
  for (int level = 0; level < static_cast<int>(table_.size()); ++level) {
    const int inside = std::clamp(level - low, 0, span);
    table_[static_cast<std::size_t>(level)] = static_cast<std::uint8_t>((255 * inside + span / 2) / span);
  }
}

void ContrastMapping::apply(ImageView<const std::uint8_t> image, ImageView<std::uint8_t> result,
                            const Workers& workers) const {
  map_rows(image, result, workers, table_, shift_);
}

void ContrastMapping::apply(ImageView<const std::uint16_t> image, ImageView<std::uint8_t> result,
                            const Workers& workers) const {
  map_rows(image, result, workers, table_, shift_);
}

}  // namespace spartan
