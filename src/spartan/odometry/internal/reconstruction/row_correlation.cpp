#include "spartan/odometry/internal/reconstruction/row_correlation.h"

#include <cmath>

namespace spartan::internal {

std::vector<float> correlate_row(ImageView<const std::uint8_t> image, int x, int y, ImageView<const std::uint8_t> other,
                                 int from, int to) {
  constexpr int rx = kCorrelationRadiusX, ry = kCorrelationRadiusY;
  constexpr int width = 2 * rx + 1, area = width * (2 * ry + 1);
  const auto count = static_cast<std::size_t>(to - from + 1);
  const std::size_t columns = count + 2 * rx;

  std::vector<std::uint32_t> product(count, 0), column_sum(columns, 0), column_square(columns, 0);
  std::int64_t reference_sum = 0, reference_square = 0;
  for (int j = -ry; j <= ry; ++j) {
    const std::uint8_t* reference = image.row(y + j) + x - rx;
    const std::uint8_t* row = other.row(y + j) + from - rx;
    for (std::size_t c = 0; c < columns; ++c) {
      column_sum[c] += row[c];
      column_square[c] += static_cast<std::uint32_t>(row[c] * row[c]);
    }
    for (int i = 0; i < width; ++i) {
      const std::uint16_t value = reference[i];
      reference_sum += value;
      reference_square += value * value;
      for (std::size_t c = 0; c < count; ++c) {
        product[c] += static_cast<std::uint16_t>(value * row[c + static_cast<std::size_t>(i)]);
      }
    }
  }

  const std::int64_t reference_variance = area * reference_square - reference_sum * reference_sum;
  std::vector<float> correlation(count, -1.0f);
  std::int64_t sum = 0, square = 0;
  for (std::size_t c = 0; c < columns; ++c) {
    sum += column_sum[c];
    square += column_square[c];
    if (c + 1 < static_cast<std::size_t>(width)) continue;
    const std::size_t index = c + 1 - width;
    const std::int64_t variance = area * square - sum * sum;
    // A standard deviation below half a gray level is quantization noise.
    if (4 * variance > area * area && 4 * reference_variance > area * area) {
      const std::int64_t covariance = area * static_cast<std::int64_t>(product[index]) - reference_sum * sum;
      correlation[index] =
          static_cast<float>(static_cast<double>(covariance) /
                             std::sqrt(static_cast<double>(variance) * static_cast<double>(reference_variance)));
    }
    sum -= column_sum[index];
    square -= column_square[index];
  }
  return correlation;
}

}  // namespace spartan::internal
