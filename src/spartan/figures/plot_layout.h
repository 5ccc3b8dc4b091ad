// Ranges, ticks and places of the parts of a plot, shared by its outputs.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "spartan/figures/plot.h"

namespace spartan::internal {

/// A round step, 1, 2 or 5 times a power of ten, that gives about `count` ticks.
double tick_step(double span, double count);
/// The multiples of tick_step() in the range.
std::vector<double> ticks_of(const Range& range, double count);
std::string tick_text(double value);

/// Where the data lie in pixels, y down.
struct PlotLayout {
  Range x, y;
  double left = 0, top = 0, width = 0, height = 0;
  double total_width = 0, total_height = 0;  ///< with the labels of the axes

  double px(double value) const { return left + (value - x.low) / x.span() * width; }
  double py(double value) const { return top + (y.high - value) / y.span() * height; }
  double x_ticks() const { return width / 80; }
  double y_ticks() const { return height / 60; }
};
/// `top_px`: height of what is above the data.
PlotLayout layout_of(const Plot& plot, double top_px);

/// Layers of a plot that can be switched: first the lines, then the markers, those of one name in a row together, then
/// the image.
struct PlotLayers {
  std::vector<std::size_t> markers;  ///< of each marker
  std::size_t image = 0;
};
PlotLayers layers_of(const Plot& plot);

/// Length in metres of a scale bar of at most a third of the width.
double scale_bar_m(const PlotLayout& layout);

}  // namespace spartan::internal
