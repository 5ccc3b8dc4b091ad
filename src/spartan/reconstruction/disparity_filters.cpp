#include "spartan/reconstruction/disparity_filters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace spartan {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
constexpr int kRowsAtOnce = 32;

}  // namespace

void drop_inconsistent(const RawDisparity& raw, double tolerance_px, const Workers& workers,
                       ImageView<float> disparity) {
  const int w = disparity.width();
  workers.for_each_part(0, disparity.height(), kRowsAtOnce, [&](int from, int to) {
    for (int y = from; y < to; ++y) {
      for (int x = 0; x < w; ++x) {
        float d = raw.left(x, y);
        if (raw.unique(x, y) == 0) d = kUnknown;
        if (tolerance_px >= 0 && !std::isnan(d)) {
          const int seen = std::clamp(x - static_cast<int>(std::lround(d)), 0, w - 1);
          const std::int16_t other = raw.right(seen, y);
          if (other == RawDisparity::kNoMatch || std::abs(static_cast<double>(d) - other) > tolerance_px + 0.5)
            d = kUnknown;
        }
        disparity(x, y) = d;
      }
    }
  });
}

void apply_masks(ImageView<const std::uint8_t> left_mask, ImageView<const std::uint8_t> right_mask,
                 ImageView<float> disparity) {
  if (left_mask.empty() && right_mask.empty()) return;
  for (int y = 0; y < disparity.height(); ++y) {
    for (int x = 0; x < disparity.width(); ++x) {
      float& d = disparity(x, y);
      if (std::isnan(d)) continue;
      if (!left_mask.empty() && left_mask(x, y) == 0) d = kUnknown;
      if (right_mask.empty() || std::isnan(d)) continue;
      const int seen = std::clamp(x - static_cast<int>(std::lround(d)), 0, disparity.width() - 1);
      if (right_mask(seen, y) == 0) d = kUnknown;
    }
  }
}

void median_3x3(ImageView<const float> in, const Workers& workers, ImageView<float> out) {
  const int w = in.width(), h = in.height();
  workers.for_each_part(0, h, kRowsAtOnce, [&](int from, int to) {
    std::array<float, 9> values{};
    for (int y = from; y < to; ++y) {
      for (int x = 0; x < w; ++x) {
        if (std::isnan(in(x, y))) {
          out(x, y) = kUnknown;
          continue;
        }
        std::size_t known = 0;
        for (int v = std::max(0, y - 1); v <= std::min(h - 1, y + 1); ++v) {
          for (int u = std::max(0, x - 1); u <= std::min(w - 1, x + 1); ++u) {
            if (!std::isnan(in(u, v))) values[known++] = in(u, v);
          }
        }
        // The lower one of an even count: a value that was measured, not a mean across an edge.
        const auto middle = values.begin() + static_cast<std::ptrdiff_t>((known - 1) / 2);
        std::nth_element(values.begin(), middle, values.begin() + static_cast<std::ptrdiff_t>(known));
        out(x, y) = *middle;
      }
    }
  });
}

void SpeckleFilter::apply(int size_px, double step_px, ImageView<float> disparity) {
  if (size_px <= 0) return;
  const int w = disparity.width(), h = disparity.height();
  labels_.assign(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), 0);
  const auto step = static_cast<float>(step_px);
  int label = 0;
  for (int y0 = 0; y0 < h; ++y0) {
    for (int x0 = 0; x0 < w; ++x0) {
      if (std::isnan(disparity(x0, y0)) || labels_[static_cast<std::size_t>(y0 * w + x0)] != 0) continue;
      ++label;
      queue_.assign(1, y0 * w + x0);
      labels_[static_cast<std::size_t>(y0 * w + x0)] = label;
      for (std::size_t next = 0; next < queue_.size(); ++next) {
        const int x = queue_[next] % w, y = queue_[next] / w;
        const float d = disparity(x, y);
        const auto visit = [&](int u, int v) {
          if (u < 0 || v < 0 || u >= w || v >= h) return;
          int& mark = labels_[static_cast<std::size_t>(v * w + u)];
          if (mark != 0 || !(std::abs(disparity(u, v) - d) <= step)) return;
          mark = label;
          queue_.push_back(v * w + u);
        };
        visit(x - 1, y);
        visit(x + 1, y);
        visit(x, y - 1);
        visit(x, y + 1);
      }
      if (static_cast<int>(queue_.size()) >= size_px) continue;
      for (const int at : queue_) disparity(at % w, at / w) = kUnknown;
    }
  }
}

}  // namespace spartan
