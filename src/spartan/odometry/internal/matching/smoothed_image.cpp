#include "spartan/odometry/internal/matching/smoothed_image.h"

#include <algorithm>

namespace spartan::internal {
namespace {

constexpr int kSmoothingRowsPerPart = 32;

template <class In>
int binomial(In a, In b, In c, In d, In e) {
  return a + e + 4 * (b + d) + 6 * c;
}

}  // namespace

void SmoothedImage::compute(ImageView<const std::uint8_t> image, const ThreadPool& workers) {
  const int width = image.width(), height = image.height();
  if (pixels_.size() != image.size()) {
    pixels_ = Image<std::uint16_t>(image.size());
    rows_ = Image<std::uint16_t>(image.size());
  }
  workers.parallel_for(0, height, kSmoothingRowsPerPart, [&](int begin, int end) {
    for (int y = begin; y < end; ++y) {
      const auto source = [&](int dy) { return image.row(std::clamp(y + dy, 0, height - 1)); };
      const std::uint8_t *a = source(-2), *b = source(-1), *c = source(0), *d = source(1), *e = source(2);
      std::uint16_t* sums = rows_.row(y);
      for (int x = 0; x < width; ++x) {
        sums[x] = static_cast<std::uint16_t>(binomial<int>(a[x], b[x], c[x], d[x], e[x]));
      }
      std::uint16_t* out = pixels_.row(y);
      const auto at = [&](int x) { return static_cast<int>(sums[std::clamp(x, 0, width - 1)]); };
      const auto border = [&](int x) {
        out[x] = static_cast<std::uint16_t>(binomial(at(x - 2), at(x - 1), at(x), at(x + 1), at(x + 2)));
      };
      for (int x = 0; x < std::min(2, width); ++x) border(x);
      for (int x = std::max(2, width - 2); x < width; ++x) border(x);
      for (int x = 2; x < width - 2; ++x) {
        out[x] = static_cast<std::uint16_t>(binomial<int>(sums[x - 2], sums[x - 1], sums[x], sums[x + 1], sums[x + 2]));
      }
    }
  });
}

}  // namespace spartan::internal
