#include "spartan/reconstruction/disparity_merger.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
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

// The nearest surface that one view sees in each cell, as sums over its pixels.
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

  explicit Layer(const PanoramaWindow& seen) : window(seen), cells(seen.size) {}
  PanoramaWindow window;  // of the panorama
  Image<Cell> cells;

  // A cell of the panorama; null outside of the window.
  const Cell* at(int x, int y) const {
    return window.contains(x, y) ? &cells(x - window.left, y - window.top) : nullptr;
  }
  Cell* at(int x, int y) { return window.contains(x, y) ? &cells(x - window.left, y - window.top) : nullptr; }
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

void DisparityMerger::rasterize_view(const MergedView& view, Layer& layer) const {
  const RectifiedStereo& g = view.geometry.stereo;
  const Eigen::Matrix4d m = reprojection(g, body_from_centre_.inverse() * view.geometry.body_from_left);
  const auto gate = static_cast<float>(options_.gate_sigmas);
  for (int v = 0; v < view.disparity.height(); ++v) {
    const double y = (v - g.centre_px.y()) / g.focal_px;
    for (int u = 0; u < view.disparity.width(); ++u) {
      const double d = view.disparity(u, v);
      if (!(d > 0)) continue;
      const Eigen::Vector4d h = m * Eigen::Vector4d(u, v, d, 1);
      const Eigen::Vector3d p = h.head<3>() / h.w();
      const double range = p.norm();
      const auto pixel = camera_.project(p);
      if (!pixel) continue;
      Layer::Cell* const cell =
          layer.at(static_cast<int>(std::lround(pixel->x())), static_cast<int>(std::lround(pixel->y())));
      if (cell == nullptr) continue;
      if (range > options_.max_range_m) {
        cell->beyond = 1;
        continue;
      }
      const double x = (u - g.centre_px.x()) / g.focal_px;
      const double sigma_px = view.sigma.empty() ? options_.disparity_sigma_px : static_cast<double>(view.sigma(u, v));
      const double per_px = range_sigma(g, d, std::sqrt(1 + x * x + y * y), 1);
      const double gate_px = std::max(sigma_px, options_.disparity_sigma_px);
      cell->add({static_cast<float>(range), static_cast<float>(per_px * per_px * sigma_px * sigma_px),
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
                               MergedRange& merged, Image<float>& gates_m) const {
  const auto gate = static_cast<float>(options_.gate_sigmas);
  std::vector<Candidate> candidates(views.size());
  for (int x = 0; x < camera_.size().width; ++x) {
    std::size_t count = 0;
    for (std::size_t k = 0; k < views.size(); ++k) {
      const Layer::Cell* const cell = layers[k].at(x, row);
      if (cell == nullptr || cell->count == 0) continue;
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

void fill_gaps(const Image<float>& gates_m, const ThreadPool& workers, MergedRange& merged) {
  const Image<float> range = merged.range_m.clone(), sigma = merged.sigma_m.clone(),
                     baseline = merged.baseline_m.clone();
  const Image<std::uint8_t> views = merged.views.clone(), gray = merged.gray.clone(), classes = merged.classes.clone();
  const auto known = [&](int x, int y) { return range.contains(x, y) && std::isfinite(range(x, y)); };
  const auto fill = [&](int x, int y) {
    for (int gap = 2; gap <= 2 * kGap; ++gap) {
      for (const auto& [dx, dy] : {std::pair{0, 1}, std::pair{1, 0}}) {
        const int a = gap / 2, b = gap - a;
        const int x0 = x - a * dx, y0 = y - a * dy, x1 = x + b * dx, y1 = y + b * dy;
        if (!known(x0, y0) || !known(x1, y1)) continue;
        const float reach = std::max(gates_m(x0, y0), gates_m(x1, y1));
        if (std::abs(range(x0, y0) - range(x1, y1)) > reach) continue;
        const float part = static_cast<float>(a) / static_cast<float>(gap);
        merged.range_m(x, y) = range(x0, y0) + part * (range(x1, y1) - range(x0, y0));
        merged.sigma_m(x, y) = std::max(sigma(x0, y0), sigma(x1, y1));
        merged.views(x, y) = views(x0, y0) | views(x1, y1);
        merged.gray(x, y) = static_cast<std::uint8_t>((gray(x0, y0) + gray(x1, y1)) / 2);
        merged.classes(x, y) = classes(x0, y0);
        merged.baseline_m(x, y) = baseline(x0, y0);
        return;
      }
    }
  };
  workers.parallel_for(0, range.height(), 16, [&](int from, int to) {
    for (int y = from; y < to; ++y) {
      for (int x = 0; x < range.width(); ++x) {
        if (!std::isfinite(range(x, y))) fill(x, y);
      }
    }
  });
}

}  // namespace

Image<std::uint8_t> DisparityMerger::upper_border(std::span<const MergedView> views, std::span<const Layer> layers,
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
  for (const Layer& layer : layers) {
    const PanoramaWindow& w = layer.window;
    for (int y = 0; y < w.size.height; ++y) {
      for (int x = 0; x < w.size.width; ++x) {
        if (layer.cells(x, y).beyond == 0) continue;
        const int row = w.top + y;
        for (int below = row + 1; below <= std::min(row + step, height - 1); ++below) border(w.left + x, below) = 1;
      }
    }
  }
  return border;
}

MergedRange DisparityMerger::merge(std::span<const MergedView> views) const {
  const ImageSize size = camera_.size();
  std::vector<Layer> layers;
  layers.reserve(views.size());
  for (const MergedView& view : views) {
    // Wider than the panorama, because cells also know of surfaces beyond its ranges.
    layers.emplace_back(
        window_of(camera_, body_from_centre_, view.geometry, 0.5 * nearest_m_, 10 * options_.max_range_m));
  }
  workers_.parallel_for(0, static_cast<int>(views.size()), 1, [&](int from, int to) {
    for (int k = from; k < to; ++k) {
      const MergedView& view = views[static_cast<std::size_t>(k)];
      if (!view.disparity.empty()) rasterize_view(view, layers[static_cast<std::size_t>(k)]);
    }
  });
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
  workers_.parallel_for(0, size.height, 16, [&](int from, int to) {
    for (int row = from; row < to; ++row) fuse_row(views, layers, row, merged, gates_m);
  });
  fill_gaps(gates_m, workers_, merged);
  merged.truncated = upper_border(views, layers, merged.range_m);
  return merged;
}

}  // namespace spartan
