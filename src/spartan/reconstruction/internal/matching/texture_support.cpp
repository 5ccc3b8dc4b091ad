#include "spartan/reconstruction/internal/matching/texture_support.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <numeric>

namespace spartan::internal::matching {
namespace {

constexpr int kCell = kGradientStep;
constexpr std::uint8_t kUnsupportedPercent = 40;  // on real pairs 30 to 69 % of them, a sky all
constexpr int kSurroundings = 6;                  // cells on each side of a cell
constexpr float kLeastSupport = 0.08F;
// A window without any gradient has no correlation.
constexpr float kLeastGradient2 = 1e-3F;
// Images without noise have that of their gray levels; here of 0.5 levels, in σ_q².
constexpr float kLeastNoise2 = 0.0625F;
// Pixels without contrast: mean of (l(x + 1) − l(x − 1))² + (l(y + 1) − l(y − 1))² in 5×5 pixels, in units of that of
// noise, 4 σ²; σ_q² is σ²/4.
constexpr int kFlatRadius = 2;
constexpr float kFlatContrast = 1.8F * 4 * 4;
// Pixels around them that have their gray level, in units of σ: the window above does not reach the edge.
constexpr int kGrowth_px = 3;
constexpr float kGrowthSigmas = 4;

float lower_quartile(std::vector<float>& values) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 4);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// Marks the pixels of a cell that have no contrast.
void mark_flat(ImageView<const std::uint8_t> left, int from_x, int from_y, float most, ImageView<std::uint8_t> marks) {
  constexpr int kSize = kCell + 2 * kFlatRadius, kSide = 2 * kFlatRadius + 1;
  const int w = left.width(), h = left.height();
  std::array<std::array<int, kCell>, kSize> sums{};  // of kSide columns
  for (int v = 0; v < kSize; ++v) {
    const int y = std::clamp(from_y - kFlatRadius + v, 0, h - 1);
    const std::uint8_t* const row = left.row(y);
    const std::uint8_t *const above = left.row(std::max(y - 1, 0)), *const below = left.row(std::min(y + 1, h - 1));
    for (int u = 0; u < kSize; ++u) {
      const int x = std::clamp(from_x - kFlatRadius + u, 0, w - 1);
      const int across = row[std::min(x + 1, w - 1)] - row[std::max(x - 1, 0)], down = below[x] - above[x];
      for (int i = std::max(0, u - kSide + 1); i <= std::min(u, kCell - 1); ++i)
        sums[static_cast<std::size_t>(v)][static_cast<std::size_t>(i)] += across * across + down * down;
    }
  }
  for (int y = from_y; y < std::min(from_y + kCell, h); ++y) {
    for (int x = from_x; x < std::min(from_x + kCell, w); ++x) {
      int sum = 0;
      for (int v = 0; v < kSide; ++v)
        sum += sums[static_cast<std::size_t>(y - from_y + v)][static_cast<std::size_t>(x - from_x)];
      marks(x, y) = static_cast<float>(sum) < most ? 1 : 0;
    }
  }
}

// Whether the pixel is marked or has a marked one of its gray level near.
bool is_near_mark(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> marks, int x, int y, float most) {
  if (marks(x, y) != 0) return true;
  for (int v = std::max(0, y - kGrowth_px); v <= std::min(left.height() - 1, y + kGrowth_px); ++v) {
    for (int u = std::max(0, x - kGrowth_px); u <= std::min(left.width() - 1, x + kGrowth_px); ++u) {
      if (marks(u, v) != 0 && static_cast<float>(std::abs(left(u, v) - left(x, y))) <= most) return true;
    }
  }
  return false;
}

}  // namespace

// w · (correlation − least) of each cell.
void TextureSupport::score(const GradientVariances& gradients, float noise) {
  const auto [w, h] = gradients.mean.size();
  scores_.resize(static_cast<std::size_t>(w) * static_cast<std::size_t>(h));
  std::size_t i = 0;
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x, ++i) {
      const float mean = gradients.mean(x, y), difference = gradients.difference(x, y);
      const float both = mean + difference + kLeastGradient2, share = std::min(1.0F, 2 * noise / both);
      const float weight = share * share;
      scores_[i] = std::isnan(mean) ? 0 : weight * (mean - difference) / both - kLeastSupport * weight;
    }
  }
}

// Whether there is a cell whose scores around it sum up to less than 0, first those of columns, then of rows.
bool TextureSupport::find_unsupported(ImageSize cells) {
  const auto w = static_cast<std::size_t>(cells.width);
  bool any = false;
  unsupported_.resize(scores_.size());
  for (int y = 0; y < cells.height; ++y) {
    columns_.assign(w, 0);
    const int last = std::min(y + kSurroundings, cells.height - 1);
    for (int v = std::max(0, y - kSurroundings); v <= last; ++v) {
      const float* const from = scores_.data() + static_cast<std::size_t>(v) * w;
      for (std::size_t x = 0; x < w; ++x) columns_[x] += from[x];
    }
    std::uint8_t* const to = unsupported_.data() + static_cast<std::size_t>(y) * w;
    for (int x = 0; x < cells.width; ++x) {
      const auto first = columns_.begin() + std::max(0, x - kSurroundings),
                 end = columns_.begin() + std::min(x + kSurroundings + 1, cells.width);
      to[x] = std::accumulate(first, end, 0.0F) < 0 ? 1 : 0;
      any |= to[x] != 0;
    }
  }
  return any;
}

void TextureSupport::assess(const GradientVariances& gradients, ImageView<const std::uint8_t> left,
                            ImageView<std::uint8_t> marks, const ThreadPool& workers,
                            ImageView<std::uint8_t> outlier_percent) {
  const auto [w, h] = gradients.mean.size();
  samples_.clear();
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      if (!std::isnan(gradients.difference(x, y))) samples_.push_back(gradients.difference(x, y));
    }
  }
  if (samples_.empty()) return;
  const float noise2 = std::max(kLeastNoise2, lower_quartile(samples_));
  score(gradients, noise2);
  if (!find_unsupported({w, h})) return;
  constexpr int kSide = 2 * kFlatRadius + 1;
  const float most_contrast = kFlatContrast * noise2 * (kSide * kSide),
              most_step = kGrowthSigmas * 2 * std::sqrt(noise2);
  const auto is_unsupported = [&, columns = w](int x, int y) {
    return unsupported_[static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) +
                        static_cast<std::size_t>(x)] != 0;
  };
  const auto for_each_cell = [&, cells = gradients.mean.size()](const auto& visit) {
    workers.parallel_for(0, cells.height, 8, [&](int from, int to) {
      for (int y = from; y < to; ++y) {
        for (int x = 0; x < cells.width; ++x) visit(x, y);
      }
    });
  };
  for_each_cell([&](int x, int y) {
    if (is_unsupported(x, y)) return mark_flat(left, x * kCell, y * kCell, most_contrast, marks);
    for (int v = y * kCell; v < std::min((y + 1) * kCell, left.height()); ++v) {
      for (int u = x * kCell; u < std::min((x + 1) * kCell, left.width()); ++u) marks(u, v) = 0;
    }
  });
  static_assert(kGrowth_px <= kCell, "the cells around a cell hold all marks that matter");
  for_each_cell([&, columns = w, rows = h](int x, int y) {
    bool near = false;
    for (int v = std::max(0, y - 1); v <= std::min(rows - 1, y + 1); ++v) {
      for (int u = std::max(0, x - 1); u <= std::min(columns - 1, x + 1); ++u) near |= is_unsupported(u, v);
    }
    if (!near) return;
    for (int v = y * kCell; v < std::min((y + 1) * kCell, left.height()); ++v) {
      for (int u = x * kCell; u < std::min((x + 1) * kCell, left.width()); ++u) {
        std::uint8_t& percent = outlier_percent(u, v);
        if (percent < kUnsupportedPercent && is_near_mark(left, marks, u, v, most_step)) percent = kUnsupportedPercent;
      }
    }
  });
}

std::size_t TextureSupport::buffer_bytes() const {
  return sizeof(float) * (samples_.capacity() + scores_.capacity() + columns_.capacity()) + unsupported_.capacity();
}

std::int64_t TextureSupport::memory_bytes(ImageSize size) {
  // Samples grow by doubling.
  return std::int64_t{4 * 2 + 4 + 4 + 1} * (size.width / kCell + 1) * (size.height / kCell + 1);
}

}  // namespace spartan::internal::matching
