#include "spartan/figures/plot_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace spartan::internal {
namespace {

constexpr double kLeft_px = kPlotMargin_px - 16, kRight_px = 16, kBottom_px = 46;
constexpr double kLeastWidth_px = 320, kLeastHeight_px = 160;  // of a plot of equal axes

void extend(Range& range, double value) {
  if (std::isfinite(value)) range = {std::min(range.low, value), std::max(range.high, value)};
}

Range with_margin(const Range& range, double share) {
  if (range.low > range.high) return {};
  const double margin = std::max(share * range.span(), 1e-9 * std::max(1.0, std::abs(range.high)));
  return {range.low - margin, range.high + margin};
}

Range widened(const Range& range, double span) {
  const double more = (span - range.span()) / 2;
  return {range.low - more, range.high + more};
}

}  // namespace

double tick_step(double span, double count) {
  const double raw = std::max(span, 1e-300) / std::max(count, 1.0), power = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (raw <= factor * power) return factor * power;
  }
  return 10 * power;
}

std::vector<double> ticks_of(const Range& range, double count) {
  const double step = tick_step(range.span(), count);
  std::vector<double> ticks;
  for (double k = std::ceil(range.low / step); k * step <= range.high && ticks.size() < 100; ++k)
    ticks.push_back(k * step);
  return ticks;
}

std::string tick_text(double value) {
  return fmt::format("{:.6g}", std::abs(value) < 1e-12 ? 0.0 : value);
}

PlotLayout layout_of(const Plot& plot, double top_px) {
  Range x{1e300, -1e300}, y = x;
  for (const PlotLine& line : plot.lines) {
    for (std::size_t i = 0; i < line.x.size(); ++i) {
      if (!std::isfinite(line.x[i]) || !std::isfinite(line.y[i])) continue;
      extend(x, line.x[i]);
      extend(y, line.y[i]);
    }
  }
  for (const PlotMarker& marker : plot.markers) {
    extend(x, marker.x);
    extend(y, marker.y);
  }
  if (plot.image) {
    for (const double value : {plot.image->x.low, plot.image->x.high}) extend(x, value);
    for (const double value : {plot.image->y.low, plot.image->y.high}) extend(y, value);
  }
  PlotLayout layout;
  layout.x = with_margin(x, plot.image ? 0 : 0.05);
  layout.y = with_margin(y, plot.image ? 0 : 0.05);
  layout.left = kLeft_px;
  layout.top = top_px;
  layout.width = plot.width_px - kLeft_px - kRight_px;
  layout.height = plot.height_px - top_px - kBottom_px;
  if (plot.equal_axes) {
    const double per_px = std::max(layout.x.span() / layout.width, layout.y.span() / layout.height);
    layout.width = std::round(std::max(layout.x.span() / per_px, std::min(layout.width, kLeastWidth_px)));
    layout.height = std::round(std::max(layout.y.span() / per_px, std::min(layout.height, kLeastHeight_px)));
    layout.x = widened(layout.x, per_px * layout.width);
    layout.y = widened(layout.y, per_px * layout.height);
  }
  layout.total_width = layout.left + layout.width + kRight_px;
  layout.total_height = layout.top + layout.height + kBottom_px;
  return layout;
}

PlotLayers layers_of(const Plot& plot) {
  PlotLayers layers;
  std::size_t layer = plot.lines.size();
  for (std::size_t i = 0; i < plot.markers.size(); ++i) {
    if (i > 0 && plot.markers[i - 1].name != plot.markers[i].name) ++layer;
    layers.markers.push_back(layer);
  }
  layers.image = plot.markers.empty() ? layer : layer + 1;
  return layers;
}

double scale_bar_m(const PlotLayout& layout) {
  const double most = layout.x.span() / 3;
  const double step = tick_step(most, 1);
  return step <= most ? step : step / (step / most > 2 ? 5 : 2);
}

}  // namespace spartan::internal
