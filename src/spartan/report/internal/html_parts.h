// Parts of a self-contained HTML page: embedded images, SVG plots, tables.
#pragma once

#include <string>
#include <vector>

#include "spartan/core/image.h"

namespace spartan::internal {

/// Escapes the characters that are special in HTML.
std::string html_text(const std::string& text);

/// An <img> with its PNG embedded, and a caption. `width_px` is the width on the page.
std::string html_image(ImageView<const std::uint8_t> image, const std::string& caption, int width_px);
std::string html_image(ImageView<const Rgb8> image, const std::string& caption, int width_px);

/// Reduces an image by block means to at most `width` columns.
Image<std::uint8_t> shrunk(ImageView<const std::uint8_t> image, int width);
Image<Rgb8> shrunk(ImageView<const Rgb8> image, int width);

/// Blue over white to red; `value` 0 … 1.
Rgb8 cold_to_hot(double value);

struct PlotLine {
  std::string name, colour;
  std::vector<double> x, y;
};
struct PlotOptions {
  std::string x_label, y_label;
  bool equal_axes = false;  ///< same scale on both axes
  int width_px = 560, height_px = 360;
};
std::string svg_plot(const std::vector<PlotLine>& lines, const PlotOptions& options);

/// A table whose first row is the header.
std::string html_table(const std::vector<std::vector<std::string>>& rows);

/// The whole page.
std::string html_page(const std::string& title, const std::string& body);

}  // namespace spartan::internal
