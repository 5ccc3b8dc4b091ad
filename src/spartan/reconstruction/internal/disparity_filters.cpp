#include "spartan/reconstruction/internal/disparity_filters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace spartan::internal {
namespace {

constexpr float kUnknownDisparity = std::numeric_limits<float>::quiet_NaN();
constexpr int kRowsAtOnce = 32;  // rows of one work item of a thread
constexpr int kBandRows = 120;   // of the speckle filter

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

void median_row(ImageView<const float> in, int y, bool (*kernel)(const matching::MedianRow&), ImageView<float> out) {
  const int w = in.width();
  const bool inside = y > 0 && y + 1 < in.height();
  const auto replace = [&](int from, int to) {
    for (int x = from; x < to; ++x) {
      if (std::isnan(out(x, y)) && !std::isnan(in(x, y))) out(x, y) = median_of_known(in, x, y);
    }
  };
  out(0, y) = out(w - 1, y) = kUnknownDisparity;
  if (!inside || w < 3) {
    std::fill_n(out.row(y), w, kUnknownDisparity);
    return replace(0, w);
  }
  const bool incomplete = kernel({{in.row(y - 1), in.row(y), in.row(y + 1)}, out.row(y), w});
  replace(0, incomplete ? w : 1);
  replace(w - 1, w);
}

}  // namespace

void fill_unknown(const ThreadPool& workers, ImageView<float> disparity) {
  const int w = disparity.width();
  workers.parallel_for(0, disparity.height(), 32, [&](int from, int to) {
    for (int y = from; y < to; ++y) {
      float* const row = disparity.row(y);
      for (int x = 0; x < w;) {
        if (!std::isnan(row[x])) {
          ++x;
          continue;
        }
        int end = x;
        while (end < w && std::isnan(row[end])) ++end;
        // std::fmin ignores NaN: at the borders of the image there is one neighbour.
        const float none = std::numeric_limits<float>::quiet_NaN();
        std::fill(row + x, row + end, std::fmin(x > 0 ? row[x - 1] : none, end < w ? row[end] : none));
        x = end;
      }
    }
  });
}

void median_3x3(ImageView<const float> in, bool (*kernel)(const matching::MedianRow&), const ThreadPool& workers,
                ImageView<float> out) {
  workers.parallel_for(0, in.height(), kRowsAtOnce, [&](int from, int to) {
    for (int y = from; y < to; ++y) median_row(in, y, kernel, out);
  });
}

int SpeckleFilter::root_of(const std::vector<Run>& runs, int run) {
  while (runs[static_cast<std::size_t>(run)].parent != run) run = runs[static_cast<std::size_t>(run)].parent;
  return run;
}

void SpeckleFilter::join(std::vector<Run>& runs, int one, int other) {
  const int first = root_of(runs, one), second = root_of(runs, other);
  // Paths to the root are shortened.
  for (int run : {one, other}) {
    for (const int root = run == one ? first : second; run != root;)
      run = std::exchange(runs[static_cast<std::size_t>(run)].parent, root);
  }
  if (first == second) return;
  Run& kept = runs[static_cast<std::size_t>(std::min(first, second))];
  Run& gone = runs[static_cast<std::size_t>(std::max(first, second))];
  gone.parent = kept.parent;
  kept.pixels += gone.pixels;
}

// Joins the runs of row y with those of the row above.
void SpeckleFilter::join_rows(std::vector<Run>& runs, const SpeckleRule& rule, ImageView<const float> disparity, int y,
                              const std::vector<int>& above, const std::vector<int>& here) {
  const auto step = static_cast<float>(rule.step_px);
  int joined = -1, joined_with = -1;
  for (int x = 0; x < disparity.width(); ++x) {
    const int upper = above[static_cast<std::size_t>(x)], run = here[static_cast<std::size_t>(x)];
    if (run < 0 || upper < 0 || (run == joined && upper == joined_with)) continue;
    if (std::abs(disparity(x, y) - disparity(x, y - 1)) > step) continue;
    join(runs, run, upper);
    joined = run;
    joined_with = upper;
  }
}

void SpeckleFilter::find_runs(const SpeckleRule& rule, ImageView<const float> disparity, int from_row, int to_row,
                              Band& band) {
  const int w = disparity.width();
  const auto step = static_cast<float>(rule.step_px);
  band.runs.clear();
  band.here.resize(static_cast<std::size_t>(w));
  for (int y = from_row; y < to_row; ++y) {
    const float* const row = disparity.row(y);
    for (int x = 0; x < w;) {
      if (std::isnan(row[x])) {
        band.here[static_cast<std::size_t>(x++)] = -1;
        continue;
      }
      const int run = static_cast<int>(band.runs.size()), from = x;
      do band.here[static_cast<std::size_t>(x++)] = run;
      while (x < w && std::abs(row[x] - row[x - 1]) <= step);
      int pixels = x - from;
      if (!rule.reliable.empty()) {
        const std::uint8_t* const reliable = rule.reliable.row(y);
        pixels = std::accumulate(reliable + from, reliable + x, 0);
      }
      band.runs.push_back({y, from, x, run, pixels});
    }
    if (y > from_row) join_rows(band.runs, rule, disparity, y, band.above, band.here);
    if (y == from_row) band.first = band.here;
    std::swap(band.above, band.here);
    band.here.resize(static_cast<std::size_t>(w));
  }
}

void SpeckleFilter::join_bands(const SpeckleRule& rule, ImageView<const float> disparity) {
  runs_.clear();
  const std::vector<int>* last = nullptr;  // runs of the last row of the band before
  int first_row = 0;
  for (Band& band : bands_) {
    const int offset = static_cast<int>(runs_.size());
    const auto shift = [offset](std::vector<int>& row) {
      for (int& run : row) run += run < 0 ? 0 : offset;
    };
    for (Run& run : band.runs) run.parent += offset;
    runs_.insert(runs_.end(), band.runs.begin(), band.runs.end());
    shift(band.first);
    shift(band.above);
    if (first_row > 0) join_rows(runs_, rule, disparity, first_row, *last, band.first);
    last = &band.above;
    first_row += kBandRows;
  }
}

void SpeckleFilter::apply(const SpeckleRule& rule, const ThreadPool& workers, ImageView<float> disparity) {
  if (rule.size_px <= 0 || disparity.empty()) return;
  bands_.resize(static_cast<std::size_t>((disparity.height() + kBandRows - 1) / kBandRows));
  workers.parallel_for(0, disparity.height(), kBandRows, [&](int from, int to) {
    find_runs(rule, disparity, from, to, bands_[static_cast<std::size_t>(from / kBandRows)]);
  });
  join_bands(rule, disparity);
  workers.parallel_for(0, static_cast<int>(runs_.size()), 4096, [&](int from, int to) {
    for (int r = from; r < to; ++r) {
      if (runs_[static_cast<std::size_t>(root_of(runs_, r))].pixels >= rule.size_px) continue;
      const Run& run = runs_[static_cast<std::size_t>(r)];
      std::fill(&disparity(run.from, run.y), &disparity(run.to - 1, run.y) + 1, kUnknownDisparity);
    }
  });
}

std::size_t SpeckleFilter::buffer_bytes() const {
  std::size_t total = runs_.capacity() * sizeof(Run);
  for (const Band& band : bands_) {
    total += band.runs.capacity() * sizeof(Run) +
             (band.first.capacity() + band.above.capacity() + band.here.capacity()) * sizeof(int);
  }
  return total;
}

}  // namespace spartan::internal
