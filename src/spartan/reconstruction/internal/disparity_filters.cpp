#include "spartan/reconstruction/internal/disparity_filters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace spartan::internal {
namespace {

constexpr float kUnknownDisparity = std::numeric_limits<float>::quiet_NaN();
constexpr int kRowsAtOnce = 32;  // rows of one work item of a thread

}  // namespace

void apply_masks(ImageView<const std::uint8_t> left_mask, ImageView<const std::uint8_t> right_mask,
                 ImageView<float> disparity) {
  if (left_mask.empty() && right_mask.empty()) return;
  for (int y = 0; y < disparity.height(); ++y) {
    for (int x = 0; x < disparity.width(); ++x) {
      float& d = disparity(x, y);
      if (std::isnan(d)) continue;
      if (!left_mask.empty() && left_mask(x, y) == 0) d = kUnknownDisparity;
      if (right_mask.empty() || std::isnan(d)) continue;
      const int matched = std::clamp(x - static_cast<int>(std::lround(d)), 0, disparity.width() - 1);
      if (right_mask(matched, y) == 0) d = kUnknownDisparity;
    }
  }
}

namespace {

// Median of the known values of the 3×3 pixels around (x, y). For an even count it is the lower of the two middle
// values: a measured disparity, not a mean across a depth edge.
float median_of_known(ImageView<const float> in, int x, int y) {
  std::array<float, 9> values{};
  std::size_t known = 0;
  for (int v = std::max(0, y - 1); v <= std::min(in.height() - 1, y + 1); ++v) {
    for (int u = std::max(0, x - 1); u <= std::min(in.width() - 1, x + 1); ++u) {
      if (!std::isnan(in(u, v))) values[known++] = in(u, v);
    }
  }
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>((known - 1) / 2);
  std::nth_element(values.begin(), middle, values.begin() + static_cast<std::ptrdiff_t>(known));
  return *middle;
}

void median_row(ImageView<const float> in, int y, void (*kernel)(const matching::MedianRow&), ImageView<float> out) {
  const int w = in.width();
  const bool inside = y > 0 && y + 1 < in.height();
  std::fill_n(out.row(y), w, kUnknownDisparity);
  if (inside) kernel({{in.row(y - 1), in.row(y), in.row(y + 1)}, out.row(y), w});
  for (int x = 0; x < w; ++x) {
    if (std::isnan(out(x, y)) && !std::isnan(in(x, y))) out(x, y) = median_of_known(in, x, y);
  }
}

}  // namespace

void median_3x3(ImageView<const float> in, void (*kernel)(const matching::MedianRow&), const ThreadPool& workers,
                ImageView<float> out) {
  workers.parallel_for(0, in.height(), kRowsAtOnce, [&](int from, int to) {
    for (int y = from; y < to; ++y) median_row(in, y, kernel, out);
  });
}

int SpeckleFilter::root_of(int run) {
  const auto parent = [&](int r) -> int& { return runs_[static_cast<std::size_t>(r)].parent; };
  while (parent(run) != run) {
    parent(run) = parent(parent(run));
    run = parent(run);
  }
  return run;
}

void SpeckleFilter::join(int one, int other) {
  const int first = root_of(one), second = root_of(other);
  if (first == second) return;
  Run& kept = runs_[static_cast<std::size_t>(std::min(first, second))];
  Run& gone = runs_[static_cast<std::size_t>(std::max(first, second))];
  gone.parent = kept.parent;
  kept.pixels += gone.pixels;
}

void SpeckleFilter::find_runs(const SpeckleRule& rule, ImageView<const float> disparity) {
  const int w = disparity.width();
  const auto step = static_cast<float>(rule.step_px);
  runs_.clear();
  above_.assign(static_cast<std::size_t>(w), -1);
  here_.resize(static_cast<std::size_t>(w));
  for (int y = 0; y < disparity.height(); ++y) {
    for (int x = 0; x < w;) {
      if (std::isnan(disparity(x, y))) {
        here_[static_cast<std::size_t>(x++)] = -1;
        continue;
      }
      const int run = static_cast<int>(runs_.size()), from = x;
      do here_[static_cast<std::size_t>(x++)] = run;
      while (x < w && std::abs(disparity(x, y) - disparity(x - 1, y)) <= step);
      int pixels = x - from;
      if (!rule.outlier_percent.empty()) {
        const std::uint8_t* const outlier = rule.outlier_percent.row(y);
        pixels = static_cast<int>(std::count_if(outlier + from, outlier + x,
                                                [&](std::uint8_t percent) { return percent <= rule.most_percent; }));
      }
      runs_.push_back({y, from, x, run, pixels});
      int joined = -1;
      for (int u = from; u < x; ++u) {
        const int above = above_[static_cast<std::size_t>(u)];
        if (above < 0 || above == joined || std::abs(disparity(u, y) - disparity(u, y - 1)) > step) continue;
        join(run, above);
        joined = above;
      }
    }
    std::swap(above_, here_);
  }
}

void SpeckleFilter::apply(const SpeckleRule& rule, ImageView<float> disparity) {
  if (rule.size_px <= 0) return;
  find_runs(rule, disparity);
  for (int r = 0; r < static_cast<int>(runs_.size()); ++r) {
    if (runs_[static_cast<std::size_t>(root_of(r))].pixels >= rule.size_px) continue;
    const Run& run = runs_[static_cast<std::size_t>(r)];
    std::fill(&disparity(run.from, run.y), &disparity(run.to - 1, run.y) + 1, kUnknownDisparity);
  }
}

}  // namespace spartan::internal
