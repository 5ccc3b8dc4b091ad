// Plots of lines and maps, written as parts of an HTML page or drawn to pixels.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "spartan/core/image.h"

namespace spartan {

struct PlotLine {
  std::string name;
  Rgb8 colour;
  std::vector<double> x, y;  ///< a point that is not finite interrupts the line
  double width_px = 2;
  double dash_px = 0;  ///< 0: a solid line
};

/// A dot, or, with a heading (counter-clockwise from x), an arrow.
struct PlotMarker {
  std::string name;
  Rgb8 colour;
  double x = 0, y = 0;
  std::optional<double> heading_rad;
};

/// An image below the lines; its borders in units of the axes.
struct PlotImage {
  std::string name;
  Image<Rgb8> pixels;
  Range x, y;
};

/// What the colours of the image mean.
struct ColourBar {
  std::string label;
  Range range;
  Rgb8 (*colour)(double) = nullptr;  ///< of 0 … 1
};
struct ColourKey {
  std::string name;
  Rgb8 colour;
};

struct Plot {
  std::string title, x_label, y_label;
  /// The same scale on both axes, in metres, with a scale bar. Width and height are then the largest that fit the data.
  bool equal_axes = false;
  std::vector<PlotLine> lines;
  std::vector<PlotMarker> markers;
  std::optional<PlotImage> image;
  std::optional<ColourBar> colour_bar;
  std::vector<ColourKey> keys;
  int width_px = 640, height_px = 400;
  int shown_px = 0;  ///< largest width on a page, on which letters grow with the plot; 0: width_px
};
inline constexpr int kPlotMargin_px = 80, kPlotHeading_px = 100;  ///< of width and height, for the labels

/// The bar with its numbers, for figures without a plot.
std::string to_html(const ColourBar& bar);

/// A figure whose layers can be switched, and which can be zoomed and read by pointing, where the script of the page
/// (report/internal/page.h) runs; without it a static plot.
std::string to_html(const Plot& plot);

/// The plot with its title and legend.
Image<Rgb8> to_image(const Plot& plot);

/// Pixels with a title above them and a legend below, without axes.
Image<Rgb8> titled_image(Image<Rgb8> pixels, const std::string& title, const std::vector<ColourKey>& keys);

}  // namespace spartan
