#include "spartan/odometry/internal/matching/sharpness.h"

#include <cstdlib>

namespace spartan::internal {
namespace {

constexpr int kRowStep = 4;
/// Consecutive images of a drive keep more than 0.8 of their differences (measured on four recordings), blur of 25 px
/// along the rows leaves less than a third.
constexpr float kBlurredRatio = 0.6f;

}  // namespace

Sharpness sharpness_of(ImageView<const std::uint16_t> smooth) {
  std::int64_t along_x = 0, along_y = 0, count = 0;
  for (int y = 0; y + 1 < smooth.height(); y += kRowStep) {
    const std::uint16_t *row = smooth.row(y), *below = smooth.row(y + 1);
    // 2¹⁵ differences of 16 bits fit into a sum of 32.
    std::uint32_t sum_x = 0, sum_y = 0;
    for (int x = 0; x + 1 < smooth.width(); ++x) {
      sum_x += static_cast<std::uint32_t>(std::abs(row[x + 1] - row[x]));
      sum_y += static_cast<std::uint32_t>(std::abs(below[x] - row[x]));
    }
    along_x += sum_x;
    along_y += sum_y;
    count += smooth.width() - 1;
  }
  if (count <= 0) return {};
  const double scale = 1 / static_cast<double>(count);
  return {static_cast<float>(scale * static_cast<double>(along_x)),
          static_cast<float>(scale * static_cast<double>(along_y))};
}

bool is_blurred(const Sharpness& image, const Sharpness& before) {
  return image.along_x < kBlurredRatio * before.along_x || image.along_y < kBlurredRatio * before.along_y;
}

}  // namespace spartan::internal
