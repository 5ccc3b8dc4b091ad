#include "spartan/odometry/internal/detection/integral_image.h"

#include <algorithm>

namespace spartan::internal {
namespace {

constexpr int kRoom = 512;  // sums behind the last row that vectors may read

}  // namespace

void IntegralImage::compute(ImageView<const std::uint8_t> image) {
  size_ = image.size();
  const ImageSize size{size_.width + 1, size_.height + 2 + kRoom / (size_.width + 1)};
  if (sums_.size() != size) sums_ = Image<std::uint32_t>(size);
  for (int y = 0; y < image.height(); ++y) {
    const std::uint8_t* pixels = image.row(y);
    const std::uint32_t* above = sums_.row(y);
    std::uint32_t* sums = sums_.row(y + 1);
    std::uint32_t row_sum = 0;
    for (int x = 0; x < image.width(); ++x) {
      row_sum += pixels[x];
      sums[x + 1] = above[x + 1] + row_sum;
    }
  }
}

std::uint32_t IntegralImage::clipped_box(int x0, int y0, int x1, int y1) const {
  x0 = std::clamp(x0, 0, width());
  x1 = std::clamp(x1, 0, width());
  y0 = std::clamp(y0, 0, height());
  y1 = std::clamp(y1, 0, height());
  if (x0 >= x1 || y0 >= y1) return 0;
  return box(x0, y0, x1, y1);
}

}  // namespace spartan::internal
