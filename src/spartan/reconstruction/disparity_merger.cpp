#include "spartan/reconstruction/disparity_merger.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

namespace spartan {
namespace {

constexpr std::size_t kViewBits = 8;  // of MergedRange::views
constexpr int kClasses = 4;
constexpr double kBorder_rad = 0.5 * std::numbers::pi / 180;  // height of the margin at the upper border of the views
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

// Reprojection matrix: (u, v, d, 1) → homogeneous point in the axes of the virtual camera.
Eigen::Matrix4d reprojection(const RectifiedStereo& g, const Pose& centre_from_left) {
  Eigen::Matrix4d q;
  q << 1, 0, 0, -g.centre_px.x(), 0, 1, 0, -g.centre_px.y(), 0, 0, 0, g.focal_px, 0, 0, 1 / g.baseline_m, 0;
  return centre_from_left.matrix() * q;
}

// Standard deviation of the range from that of the disparity: σ_z = z² σ_d / (f b), times `stretch`, the ratio of range
// and depth.
double range_sigma(const RectifiedStereo& g, double disparity, double stretch, double sigma_px) {
  const double fb = g.focal_px * g.baseline_m, depth = fb / disparity;
  return depth * depth * sigma_px / fb * stretch;
}

}  // namespace

// Where the pixels of a view fall in the panorama. Kept, so that the panorama can be filled band by band.
struct DisparityMerger::Projection {
  struct Cell {
    std::int16_t column, row;  // row −1: the pixel falls into no cell
  };
  Image<Cell> cells;
  Image<float> range_m;
  std::vector<std::pair<int, int>> rows;  // first and last row of the panorama that each row of the view reaches
};

// The nearest surface that one view sees in each cell of a band of rows, as sums over its pixels.
struct DisparityMerger::Layer {
  struct Pixel {
    float range, variance_m2;
    float gate_m2;  // the variance that gates use
    std::uint8_t level, kind;
  };
  struct Cell {
    float sum_range = 0, sum_variance = 0, sum_gate = 0, sum_gray = 0;
    std::uint32_t votes = 0;  // pixels of each class, one saturating byte per class
    std::uint16_t count = 0;
    std::uint8_t beyond = 0;  // not 0: a surface beyond the largest range

    float mean(float sum) const { return sum / static_cast<float>(count); }
    void add(const Pixel& pixel, float gate) {
      const float r = pixel.range;
      if (count > 0) {
        const float before = mean(sum_range), reach = gate * std::sqrt(pixel.gate_m2);
        if (r > before + reach || count == 0xFFFF) return;
        if (r < before - reach) {
          const std::uint8_t kept = beyond;
          *this = {};
          beyond = kept;
        }
      }
      ++count;
      sum_range += r;
      sum_variance += pixel.variance_m2;
      sum_gate += pixel.gate_m2;
      sum_gray += pixel.level;
      const unsigned shift = 8U * std::min<unsigned>(pixel.kind, kClasses - 1);
      if ((votes >> shift & 0xFFU) != 0xFFU) votes += 1U << shift;
    }
  };

  PanoramaWindow window;  // of the panorama
  std::vector<Cell> cells;

  void reset(const PanoramaWindow& to) {
    window = to;
    cells.assign(static_cast<std::size_t>(to.size.width) * static_cast<std::size_t>(to.size.height), {});
  }
  // A cell of the panorama; null outside of the window.
  const Cell* at(int x, int y) const { return window.contains(x, y) ? &cells[index(x, y)] : nullptr; }
  Cell* at(int x, int y) { return window.contains(x, y) ? &cells[index(x, y)] : nullptr; }

 private:
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y - window.top) * static_cast<std::size_t>(window.size.width) +
           static_cast<std::size_t>(x - window.left);
  }
};

Result<DisparityMerger> DisparityMerger::create(const MergingOptions& options, const Pose& body_from_centre,
                                                std::span<const ViewGeometry> views, double nearest_m,
                                                ThreadPool workers) {
  if (Status valid = validate(options, "merging options"); !valid) return failure(valid);
  return DisparityMerger(options, body_from_centre, views, nearest_m, std::move(workers));
}

DisparityMerger::DisparityMerger(const MergingOptions& options, const Pose& body_from_centre,
                                 std::span<const ViewGeometry> views, double nearest_m, ThreadPool workers)
    : options_(options), nearest_m_(nearest_m), body_from_centre_(body_from_centre), workers_(std::move(workers)) {
  camera_ = plan_panorama(options.projection, options.pixels_per_degree * 180 / std::numbers::pi, body_from_centre,
                          views, nearest_m, options.max_range_m);
}

DisparityMerger::Projection DisparityMerger::project(const MergedView& view) const {
  const RectifiedStereo& g = view.geometry.stereo;
  const Eigen::Matrix4d m = reprojection(g, body_from_centre_.inverse() * view.geometry.body_from_left);
  const ImageSize size = view.disparity.size(), panorama = camera_.size();
  Projection to{Image<Projection::Cell>(size), Image<float>(size), {}};
  to.rows.assign(static_cast<std::size_t>(size.height), {panorama.height, -1});
  workers_.parallel_for(0, size.height, 32, [&](int from, int end) {
    for (int v = from; v < end; ++v) {
      auto& [first, last] = to.rows[static_cast<std::size_t>(v)];
      for (int u = 0; u < size.width; ++u) {
        Projection::Cell& cell = to.cells(u, v);
        cell = {-1, -1};
        const double d = view.disparity(u, v);
        if (!(d > 0)) continue;
        const Eigen::Vector4d h = m * Eigen::Vector4d(u, v, d, 1);
        const Eigen::Vector3d p = h.head<3>() / h.w();
        const auto pixel = camera_.project(p);
        if (!pixel) continue;
        const auto column = std::lround(pixel->x()), row = std::lround(pixel->y());
        if (column < 0 || row < 0 || column >= panorama.width || row >= panorama.height) continue;
        cell = {static_cast<std::int16_t>(column), static_cast<std::int16_t>(row)};
        to.range_m(u, v) = static_cast<float>(p.norm());
        first = std::min(first, static_cast<int>(row));
        last = std::max(last, static_cast<int>(row));
      }
    }
  });
  return to;
}

void DisparityMerger::rasterize(const MergedView& view, const Projection& projection, Layer& layer) const {
  const RectifiedStereo& g = view.geometry.stereo;
  const auto gate = static_cast<float>(options_.gate_sigmas);
  const int band_first = layer.window.top, band_last = band_first + layer.window.size.height - 1;
  for (int v = 0; v < view.disparity.height(); ++v) {
    const auto& [first, last] = projection.rows[static_cast<std::size_t>(v)];
    if (last < band_first || first > band_last) continue;
    const double y = (v - g.centre_px.y()) / g.focal_px;
    for (int u = 0; u < view.disparity.width(); ++u) {
      const Projection::Cell to = projection.cells(u, v);
      if (to.row < band_first) continue;
      Layer::Cell* const cell = layer.at(to.column, to.row);
      if (cell == nullptr) continue;
      const float range = projection.range_m(u, v);
      if (range > static_cast<float>(options_.max_range_m)) {
        cell->beyond = 1;
        continue;
      }
      const double x = (u - g.centre_px.x()) / g.focal_px, d = view.disparity(u, v);
      const double sigma_px = view.sigma.empty() ? options_.disparity_sigma_px : static_cast<double>(view.sigma(u, v));
      const double per_px = range_sigma(g, d, std::sqrt(1 + x * x + y * y), 1);
      const double gate_px = std::max(sigma_px, options_.disparity_sigma_px);
      cell->add({range, static_cast<float>(per_px * per_px * sigma_px * sigma_px),
                 static_cast<float>(per_px * per_px * gate_px * gate_px), view.left(u, v),
                 view.classes.empty() ? std::uint8_t{0} : view.classes(u, v)},
                gate);
    }
  }
}

namespace {

// The surface that one view sees in a cell.
struct Candidate {
  std::size_t view = 0;
  float range = 0, variance = 0, gate = 0, gray = 0;
  std::uint32_t votes = 0;
  int count = 0;
};

// Whether a view sees free space at a point: its disparity at the point's pixel is smaller by more than the gate.
bool sees_free_space(const MergedView& view, const Eigen::Vector3d& point_in_body, double gate, double sigma_px) {
  const RectifiedStereo& g = view.geometry.stereo;
  const Eigen::Vector3d in_left = view.geometry.body_from_left.inverse() * point_in_body;
  if (in_left.z() <= 0) return false;
  const Eigen::Vector3d uvd = g.project(in_left);
  const int u = static_cast<int>(std::lround(uvd.x())), v = static_cast<int>(std::lround(uvd.y()));
  if (!view.disparity.contains(u, v)) return false;
  const float seen = view.disparity(u, v);
  return seen > 0 && seen < uvd.z() - gate * std::numbers::sqrt2 * sigma_px;
}

std::uint8_t most_votes(std::uint32_t votes) {
  std::uint8_t best = 0;
  for (std::uint8_t k = 1; k < kClasses; ++k) {
    if ((votes >> 8U * k & 0xFFU) > (votes >> 8U * best & 0xFFU)) best = k;
  }
  return best;
}

}  // namespace

void DisparityMerger::fuse_row(std::span<const MergedView> views, std::span<const Layer> layers, int row,
                               const Fused& to) const {
  auto& [merged, gates_m, beyond] = to;
  const auto gate = static_cast<float>(options_.gate_sigmas);
  std::vector<Candidate> candidates(views.size());
  for (int x = 0; x < camera_.size().width; ++x) {
    std::size_t count = 0;
    for (std::size_t k = 0; k < views.size(); ++k) {
      const Layer::Cell* const cell = layers[k].at(x, row);
      if (cell == nullptr) continue;
      if (cell->beyond != 0) beyond(x, row) = 1;
      if (cell->count == 0) continue;
      candidates[count++] = {k, cell->mean(cell->sum_range),
                             // The mean of the pixels' variances, not the variance of their mean: errors of
                             // neighbouring disparities are correlated.
                             cell->mean(cell->sum_variance), cell->mean(cell->sum_gate), cell->mean(cell->sum_gray),
                             cell->votes, cell->count};
    }
    if (count == 0) continue;
    std::sort(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(count),
              [](const Candidate& a, const Candidate& b) {
                return a.range != b.range ? a.range < b.range : a.view < b.view;
              });
    // From the nearest surface on: it is retained unless more views see free space through it than see it.
    std::size_t first = 0, last = 0;
    while (true) {
      last = first + 1;
      while (last < count && candidates[last].range - candidates[first].range <
                                 gate * std::sqrt(candidates[last].gate + candidates[first].gate)) {
        ++last;
      }
      if (last == count) break;
      const Eigen::Vector3d point =
          body_from_centre_ * Eigen::Vector3d(static_cast<double>(candidates[first].range) * camera_.direction(x, row));
      std::size_t free_space_votes = 0;
      for (std::size_t i = last; i < count; ++i) {
        free_space_votes +=
            sees_free_space(views[candidates[i].view], point, options_.gate_sigmas, options_.disparity_sigma_px) ? 1
                                                                                                                 : 0;
      }
      if (free_space_votes <= last - first) break;
      first = last;
    }
    float weights = 0, sum = 0, gray = 0, gate_weights = 0;
    std::uint8_t seen_by = 0;
    double baseline_m = 0;
    const Candidate* best = &candidates[first];
    for (std::size_t i = first; i < last; ++i) {
      const Candidate& c = candidates[i];
      weights += 1 / c.variance;
      gate_weights += 1 / c.gate;
      sum += c.range / c.variance;
      gray += c.gray / c.variance;
      seen_by = static_cast<std::uint8_t>(seen_by | 1U << c.view % kViewBits);
      baseline_m = std::max(baseline_m, views[c.view].geometry.stereo.baseline_m);
      if (c.count > best->count) best = &c;
    }
    merged.range_m(x, row) = sum / weights;
    merged.sigma_m(x, row) = std::sqrt(1 / weights);
    gates_m(x, row) = gate * std::sqrt(1 / gate_weights);
    merged.gray(x, row) = static_cast<std::uint8_t>(std::lround(gray / weights));
    merged.views(x, row) = seen_by;
    merged.classes(x, row) = most_votes(best->votes);
    merged.baseline_m(x, row) = static_cast<float>(baseline_m);
  }
}

namespace {

// Maximum distance in cells of the known cells from which a gap is interpolated. Gaps occur where the cells of the
// virtual camera are smaller than the pixels of a view.
constexpr int kGap = 2;

struct FilledCell {
  int x, y;
  float range_m, sigma_m, baseline_m;
  std::uint8_t views, gray, classes;
};

// The interpolated cell between two known ones, if they belong to one surface.
std::optional<FilledCell> filled_gap(const MergedRange& merged, const Image<float>& gates_m, int x, int y) {
  const auto known = [&](int u, int v) { return merged.range_m.contains(u, v) && std::isfinite(merged.range_m(u, v)); };
  for (int gap = 2; gap <= 2 * kGap; ++gap) {
    for (const auto& [dx, dy] : {std::pair{0, 1}, std::pair{1, 0}}) {
      const int a = gap / 2, b = gap - a;
      const int x0 = x - a * dx, y0 = y - a * dy, x1 = x + b * dx, y1 = y + b * dy;
      if (!known(x0, y0) || !known(x1, y1)) continue;
      const float reach = std::max(gates_m(x0, y0), gates_m(x1, y1));
      const float near = merged.range_m(x0, y0), far = merged.range_m(x1, y1);
      if (std::abs(near - far) > reach) continue;
      const float part = static_cast<float>(a) / static_cast<float>(gap);
      return FilledCell{x,
                        y,
                        near + part * (far - near),
                        std::max(merged.sigma_m(x0, y0), merged.sigma_m(x1, y1)),
                        merged.baseline_m(x0, y0),
                        static_cast<std::uint8_t>(merged.views(x0, y0) | merged.views(x1, y1)),
                        static_cast<std::uint8_t>((merged.gray(x0, y0) + merged.gray(x1, y1)) / 2),
                        merged.classes(x0, y0)};
    }
  }
  return std::nullopt;
}

// All gaps are found before the first is filled: none is interpolated from another.
void fill_gaps(const Image<float>& gates_m, const ThreadPool& workers, MergedRange& merged) {
  constexpr int kRows = 16;
  const int height = merged.range_m.height(), width = merged.range_m.width();
  std::vector<std::vector<FilledCell>> found(static_cast<std::size_t>((height + kRows - 1) / kRows));
  workers.parallel_for(0, height, kRows, [&](int from, int to) {
    for (int y = from; y < to; ++y) {
      for (int x = 0; x < width; ++x) {
        if (std::isfinite(merged.range_m(x, y))) continue;
        if (const auto cell = filled_gap(merged, gates_m, x, y))
          found[static_cast<std::size_t>(from / kRows)].push_back(*cell);
      }
    }
  });
  for (const auto& cells : found) {
    for (const FilledCell& cell : cells) {
      merged.range_m(cell.x, cell.y) = cell.range_m;
      merged.sigma_m(cell.x, cell.y) = cell.sigma_m;
      merged.baseline_m(cell.x, cell.y) = cell.baseline_m;
      merged.views(cell.x, cell.y) = cell.views;
      merged.gray(cell.x, cell.y) = cell.gray;
      merged.classes(cell.x, cell.y) = cell.classes;
    }
  }
}

}  // namespace

Image<std::uint8_t> DisparityMerger::upper_border(std::span<const MergedView> views, const Image<std::uint8_t>& beyond,
                                                  const Image<float>& range_m) const {
  const auto [width, height] = camera_.size();
  const int step = std::max(1, static_cast<int>(std::lround(kBorder_rad * camera_.per_radian())));
  // Whether a view looks at the point that is kBorder_rad above a cell and as far away.
  const auto is_covered_above = [&](int x, int y) {
    if (y < step) return false;
    const Eigen::Vector3d point =
        body_from_centre_ * Eigen::Vector3d(static_cast<double>(range_m(x, y)) * camera_.direction(x, y - step));
    return std::any_of(views.begin(), views.end(), [&](const MergedView& view) {
      const RectifiedStereo& g = view.geometry.stereo;
      const Eigen::Vector3d p = view.geometry.body_from_left.inverse() * point;
      if (view.disparity.empty() || p.z() <= 0) return false;
      const Eigen::Vector2d pixel = g.focal_px * p.head<2>() / p.z() + g.centre_px;
      return pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < view.disparity.width() &&
             pixel.y() < view.disparity.height();
    });
  };
  Image<std::uint8_t> border(width, height);
  workers_.parallel_for(0, height, 16, [&](int from, int to) {
    for (int y = from; y < to; ++y) {
      for (int x = 0; x < width; ++x) {
        if (std::isfinite(range_m(x, y))) border(x, y) = is_covered_above(x, y) ? 0 : 1;
      }
    }
  });
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (beyond(x, y) == 0) continue;
      for (int below = y + 1; below <= std::min(y + step, height - 1); ++below) border(x, below) = 1;
    }
  }
  return border;
}

void DisparityMerger::fill_bands(std::span<const MergedView> views, const Fused& fused) const {
  constexpr int kBand = 64;  // rows, few enough for the layers of all views to stay in the cache
  std::vector<Projection> projections;
  std::vector<PanoramaWindow> windows;
  for (const MergedView& view : views) {
    projections.push_back(project(view));
    // Wider than the panorama, because cells also know of surfaces beyond its ranges.
    windows.push_back(
        window_of(camera_, body_from_centre_, view.geometry, 0.5 * nearest_m_, 10 * options_.max_range_m));
  }
  workers_.parallel_for(0, camera_.size().height, kBand, [&](int from, int to) {
    std::vector<Layer> layers(views.size());
    for (std::size_t k = 0; k < views.size(); ++k) {
      PanoramaWindow window = windows[k];
      const int first = std::max(from, window.top), last = std::min(to, window.top + window.size.height);
      window.top = first;
      window.size.height = std::max(0, last - first);
      layers[k].reset(window);
      if (!views[k].disparity.empty()) rasterize(views[k], projections[k], layers[k]);
    }
    for (int row = from; row < to; ++row) fuse_row(views, layers, row, fused);
  });
}

MergedRange DisparityMerger::merge(std::span<const MergedView> views) const {
  const ImageSize size = camera_.size();
  MergedRange merged{camera_,
                     body_from_centre_,
                     Image<float>(size.width, size.height, kNaN),
                     Image<float>(size.width, size.height, kNaN),
                     Image<std::uint8_t>(size),
                     Image<std::uint8_t>(size),
                     Image<std::uint8_t>(size),
                     Image<float>(size.width, size.height, 0.0F),
                     {}};
  Image<float> gates_m(size);
  Image<std::uint8_t> beyond(size);
  fill_bands(views, {merged, gates_m, beyond});
  fill_gaps(gates_m, workers_, merged);
  merged.truncated = upper_border(views, beyond, merged.range_m);
  return merged;
}

}  // namespace spartan
