#include "spartan/odometry/internal/detection/feature_spread.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace spartan::internal {
namespace {

bool stronger(const Feature& a, const Feature& b) {
  return std::tuple(-a.strength, a.y, a.x, a.scale) < std::tuple(-b.strength, b.y, b.x, b.scale);
}

}  // namespace

Occupancy::Occupancy(ImageSize size, double spacing_px)
    : spacing_px_(spacing_px),
      cell_px_(std::max(spacing_px, 1.0)),
      columns_(static_cast<int>(size.width / cell_px_) + 3),
      rows_(static_cast<int>(size.height / cell_px_) + 3),
      first_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), -1) {}

bool Occupancy::is_free(double x, double y) const {
  const int column = cell_of(x), row = cell_of(y);
  for (int r = std::max(row - 1, 0); r <= std::min(row + 1, rows_ - 1); ++r) {
    for (int c = std::max(column - 1, 0); c <= std::min(column + 1, columns_ - 1); ++c) {
      for (std::int32_t i = first_[static_cast<std::size_t>(r * columns_ + c)]; i >= 0;) {
        const Point& point = points_[static_cast<std::size_t>(i)];
        const double dx = point.x - x, dy = point.y - y;
        if (dx * dx + dy * dy < spacing_px_ * spacing_px_) return false;
        i = point.next;
      }
    }
  }
  return true;
}

void Occupancy::take(double x, double y) {
  const int column = std::clamp(cell_of(x), 0, columns_ - 1), row = std::clamp(cell_of(y), 0, rows_ - 1);
  std::int32_t& first = first_[static_cast<std::size_t>(row * columns_ + column)];
  points_.push_back({static_cast<float>(x), static_cast<float>(y), first});
  first = static_cast<std::int32_t>(points_.size()) - 1;
}

bool is_allowed(const Feature& feature, ImageView<const std::uint8_t> mask) {
  if (mask.empty()) return true;
  const int x = static_cast<int>(std::lround(feature.x)), y = static_cast<int>(std::lround(feature.y));
  return mask.contains(x, y) && mask(x, y) != 0;
}

void discard_masked(std::vector<Feature>& features, ImageView<const std::uint8_t> mask) {
  if (mask.empty()) return;
  std::erase_if(features, [&](const Feature& f) { return !is_allowed(f, mask); });
}

std::vector<std::uint32_t> spread_indices(std::span<const Feature> features, ImageSize size, int count,
                                          double spacing_px, std::span<const Eigen::Vector2f> taken) {
  struct Entry {
    float strength;
    std::uint32_t index;
  };
  std::vector<Entry> entries;
  entries.reserve(features.size());
  for (std::size_t i = 0; i < features.size(); ++i)
    entries.push_back({features[i].strength, static_cast<std::uint32_t>(i)});
  std::sort(entries.begin(), entries.end(), [&](const Entry& a, const Entry& b) {
    return a.strength != b.strength ? a.strength > b.strength : stronger(features[a.index], features[b.index]);
  });
  const auto total = static_cast<double>(static_cast<std::size_t>(std::max(count, 0)) + taken.size());
  const double cell_px = std::sqrt(4.0 * size.width * size.height / std::max(total, 1.0));
  const int columns = static_cast<int>(size.width / cell_px) + 1, rows = static_cast<int>(size.height / cell_px) + 1;
  const auto cell_of = [&](double x, double y) {
    return static_cast<std::size_t>(std::clamp(static_cast<int>(y / cell_px), 0, rows - 1)) *
               static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(std::clamp(static_cast<int>(x / cell_px), 0, columns - 1));
  };

  Occupancy occupancy(size, spacing_px);
  std::vector<int> filled(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), 0);
  for (const Eigen::Vector2f& place : taken) {
    occupancy.take(place.x(), place.y());
    ++filled[cell_of(place.x(), place.y())];
  }
  struct Ranked {
    int rank;           // number of stronger features in its cell
    std::size_t order;  // in decreasing strength
    std::uint32_t index;
  };
  std::vector<Ranked> ranked;
  for (std::size_t k = 0; k < entries.size(); ++k) {
    const Feature& f = features[entries[k].index];
    if (!occupancy.is_free(f.x, f.y)) continue;
    occupancy.take(f.x, f.y);
    ranked.push_back({filled[cell_of(f.x, f.y)]++, k, entries[k].index});
  }
  std::stable_sort(ranked.begin(), ranked.end(), [](const Ranked& a, const Ranked& b) { return a.rank < b.rank; });
  if (ranked.size() > static_cast<std::size_t>(std::max(count, 0))) ranked.resize(static_cast<std::size_t>(count));
  std::sort(ranked.begin(), ranked.end(), [](const Ranked& a, const Ranked& b) { return a.order < b.order; });

  std::vector<std::uint32_t> kept;
  kept.reserve(ranked.size());
  for (const Ranked& r : ranked) kept.push_back(r.index);
  return kept;
}

std::vector<Feature> spread_features(std::span<const Feature> features, ImageSize size, int count, double spacing_px,
                                     std::span<const Eigen::Vector2f> taken) {
  const std::vector<std::uint32_t> indices = spread_indices(features, size, count, spacing_px, taken);
  std::vector<Feature> kept;
  kept.reserve(indices.size());
  for (const std::uint32_t index : indices) kept.push_back(features[index]);
  return kept;
}

}  // namespace spartan::internal
