#include "spartan/odometry/internal/matching/image_pyramid.h"

#include <algorithm>

#include "spartan/odometry/internal/matching/patch_alignment.h"

namespace spartan::internal {
namespace {

/// Largest distance from the prediction in pixels of a level, and where the level before has failed.
constexpr double kEighthRadius_px = 4, kQuarterRadius_px = 2.5, kAloneRadius_px = 5;

void halve(ImageView<const std::uint16_t> image, Image<std::uint16_t>& half) {
  const ImageSize size{(image.width() + 1) / 2, (image.height() + 1) / 2};
  if (half.size() != size) half = Image<std::uint16_t>(size);
  for (int y = 0; y < size.height; ++y) {
    const std::uint16_t* const from = image.row(2 * y);
    std::uint16_t* const to = half.row(y);
    for (int x = 0; x < size.width; ++x) to[x] = from[2 * x];
  }
}

/// Every other pixel after the binomial filter in both directions.
void smooth_and_halve(ImageView<const std::uint16_t> image, Image<std::uint16_t>& half) {
  const int width = image.width(), height = image.height();
  const ImageSize size{(width + 1) / 2, (height + 1) / 2};
  if (half.size() != size) half = Image<std::uint16_t>(size);
  constexpr int kBorder = 2;
  std::vector<std::uint32_t> sums(static_cast<std::size_t>(width + 2 * kBorder));
  for (int y = 0; y < size.height; ++y) {
    const auto row = [&](int offset) { return image.row(std::clamp(2 * y + offset, 0, height - 1)); };
    const std::uint16_t *a = row(-2), *b = row(-1), *c = row(0), *d = row(1), *e = row(2);
    std::uint32_t* const s = sums.data() + kBorder;
    for (int x = 0; x < width; ++x) {
      s[x] = static_cast<std::uint32_t>(a[x] + e[x]) + 4U * static_cast<std::uint32_t>(b[x] + d[x]) +
             6U * static_cast<std::uint32_t>(c[x]);
    }
    std::fill_n(sums.data(), kBorder, s[0]);
    std::fill_n(s + width, kBorder, s[width - 1]);
    std::uint16_t* const to = half.row(y);
    for (int x = 0; x < size.width; ++x) {
      const std::uint32_t* const p = s + 2 * x;
      to[x] = static_cast<std::uint16_t>((p[-2] + p[2] + 4 * (p[-1] + p[1]) + 6 * p[0] + 128) >> 8U);
    }
  }
}

void add_margin(ImageView<const std::uint16_t> image, int margin, Image<std::uint16_t>& level) {
  const ImageSize size{image.width() + 2 * margin, image.height() + 2 * margin};
  if (level.size() != size) level = Image<std::uint16_t>(size);
  for (int y = 0; y < size.height; ++y) {
    const std::uint16_t* const from = image.row(std::clamp(y - margin, 0, image.height() - 1));
    std::uint16_t* const to = level.row(y);
    std::fill_n(to, margin, from[0]);
    std::copy_n(from, image.width(), to + margin);
    std::fill_n(to + margin + image.width(), margin, from[image.width() - 1]);
  }
}

}  // namespace

void ImagePyramid::compute(ImageView<const std::uint16_t> smooth) {
  halve(smooth, half_);
  smooth_and_halve(half_, quarter_);
  smooth_and_halve(quarter_, eighth_);
  add_margin(quarter_, kMargin, levels_[0]);
  add_margin(eighth_, kMargin, levels_[1]);
}

ImagePyramid ImagePyramid::clone() const {
  ImagePyramid copy;
  for (int i = 0; i < kLevels; ++i) copy.set_level(i, levels_[static_cast<std::size_t>(i)].clone());
  return copy;
}

std::optional<Eigen::Vector2d> find_in_pyramid(const ImagePyramid& previous, const ImagePyramid& current,
                                               const Eigen::Vector2d& previous_px, const Eigen::Matrix2d& warp,
                                               const Eigen::Vector2d& predicted_px, double min_correlation) {
  const auto align = [&](int level, const Eigen::Vector2d& start, double radius_px) -> std::optional<PatchAlignment> {
    const double scale = ImagePyramid::kScale[static_cast<std::size_t>(level)];
    const Eigen::Vector2d margin = Eigen::Vector2d::Constant(ImagePyramid::kMargin);
    const auto reference = AlignmentTemplate::around(previous.level(level), previous_px / scale + margin);
    if (!reference) return std::nullopt;
    auto found = align_translation(*reference, current.level(level), warp, start / scale + margin, radius_px);
    if (found) found->position = (found->position - margin) * scale;
    return found;
  };
  const auto eighth = align(1, predicted_px, kEighthRadius_px);
  const auto quarter = eighth ? align(0, eighth->position, kQuarterRadius_px) : align(0, predicted_px, kAloneRadius_px);
  if (!quarter || quarter->correlation < min_correlation) return std::nullopt;
  return quarter->position;
}

}  // namespace spartan::internal
