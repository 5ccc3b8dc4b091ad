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
      cells_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)) {}

bool Occupancy::is_free(double x, double y) const {
  const int column = cell_of(x), row = cell_of(y);
  for (int r = std::max(row - 1, 0); r <= std::min(row + 1, rows_ - 1); ++r) {
    for (int c = std::max(column - 1, 0); c <= std::min(column + 1, columns_ - 1); ++c) {
      for (const Point& point : cells_[static_cast<std::size_t>(r * columns_ + c)]) {
        if (std::hypot(point.x - x, point.y - y) < spacing_px_) return false;
      }
    }
  }
  return true;
}

void Occupancy::take(double x, double y) {
  const int column = std::clamp(cell_of(x), 0, columns_ - 1), row = std::clamp(cell_of(y), 0, rows_ - 1);
  cells_[static_cast<std::size_t>(row * columns_ + column)].push_back({static_cast<float>(x), static_cast<float>(y)});
}

std::vector<Feature> spread_features(std::vector<Feature> features, ImageSize size, int count, double spacing_px) {
  std::sort(features.begin(), features.end(), stronger);
  const double cell_px = std::sqrt(4.0 * size.width * size.height / std::max(count, 1));
  const int columns = static_cast<int>(size.width / cell_px) + 1, rows = static_cast<int>(size.height / cell_px) + 1;

  Occupancy occupancy(size, spacing_px);
  std::vector<int> filled(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), 0);
  struct Ranked {
    int rank;  // number of stronger features in its cell
    std::size_t index;
  };
  std::vector<Ranked> ranked;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const Feature& f = features[i];
    if (!occupancy.is_free(f.x, f.y)) continue;
    occupancy.take(f.x, f.y);
    const int cell = static_cast<int>(f.y / cell_px) * columns + static_cast<int>(f.x / cell_px);
    ranked.push_back({filled[static_cast<std::size_t>(cell)]++, i});
  }
  std::stable_sort(ranked.begin(), ranked.end(), [](const Ranked& a, const Ranked& b) { return a.rank < b.rank; });
  if (ranked.size() > static_cast<std::size_t>(count)) ranked.resize(static_cast<std::size_t>(count));
  std::sort(ranked.begin(), ranked.end(), [](const Ranked& a, const Ranked& b) { return a.index < b.index; });

  std::vector<Feature> kept;
  kept.reserve(ranked.size());
  for (const Ranked& r : ranked) kept.push_back(features[r.index]);
  return kept;
}

}  // namespace spartan::internal
