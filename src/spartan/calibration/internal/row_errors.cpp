#include "spartan/calibration/internal/row_errors.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "spartan/numerics/median.h"

namespace spartan::internal {
namespace {

constexpr int kColumns = 8, kRows = 6, kMinMatchesPerCell = 3;
static_assert(kColumns * kRows == kRowErrorCells);

}  // namespace

RowErrors row_errors(std::vector<double> signed_px) {
  std::erase_if(signed_px, [](double v) { return !std::isfinite(v); });
  if (signed_px.empty()) return {kNan, kNan, kNan};
  RowErrors errors;
  errors.median_px = median(signed_px);
  std::vector<double> absolute;
  absolute.reserve(signed_px.size());
  for (const double v : signed_px) absolute.push_back(std::abs(v));
  std::sort(absolute.begin(), absolute.end());
  for (const double v : absolute) errors.mean_px += v / static_cast<double>(absolute.size());
  errors.p95_px = absolute[(absolute.size() * 95) / 100];
  return errors;
}

std::vector<RowErrorCell> map_row_errors(const std::vector<PixelMatch>& matches, const std::vector<double>& signed_px,
                                         ImageSize image_size) {
  if (image_size.empty()) return {};
  std::vector<std::vector<double>> cells(kRowErrorCells);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (!std::isfinite(signed_px[i])) continue;
    const Eigen::Vector2d& p = matches[i].left;
    const int column = std::clamp(static_cast<int>(p.x() * kColumns / image_size.width), 0, kColumns - 1);
    const int row = std::clamp(static_cast<int>(p.y() * kRows / image_size.height), 0, kRows - 1);
    cells[static_cast<std::size_t>(row * kColumns + column)].push_back(signed_px[i]);
  }
  std::vector<RowErrorCell> map;
  for (int k = 0; k < kRowErrorCells; ++k) {
    std::vector<double>& errors = cells[static_cast<std::size_t>(k)];
    const int count = static_cast<int>(errors.size());
    if (count < kMinMatchesPerCell) continue;
    const int column = k % kColumns, row = k / kColumns;
    map.push_back({{(column + 0.5) * image_size.width / kColumns, (row + 0.5) * image_size.height / kRows},
                   count,
                   median(std::move(errors))});
  }
  return map;
}

}  // namespace spartan::internal
