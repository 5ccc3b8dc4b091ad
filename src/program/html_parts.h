// Pieces of a self-contained HTML page: pictures inside the file, plots as SVG.
#pragma once

#include <string>
#include <vector>

#include "spartan/core/image.h"

namespace spartan::program {

/// Text with the characters that HTML keeps for itself replaced.
std::string html_text(const std::string& text);

/// An <img> that holds its PNG, with a caption. `width_px` is how wide the page shows it.
std::string html_picture(ImageView<const std::uint8_t> image, const std::string& caption, int width_px);
std::string html_picture(ImageView<const Rgb8> image, const std::string& caption, int width_px);

/// Mean of blocks, so that the picture is at most `width` wide.
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
  bool equal_axes = false;  ///< a metre is as long in both directions
  int width_px = 560, height_px = 360;
};
std::string svg_plot(const std::vector<PlotLine>& lines, const PlotOptions& options);

/// A table; the first row is its head.
std::string html_table(const std::vector<std::vector<std::string>>& rows);

/// The whole page.
std::string html_page(const std::string& title, const std::string& body);

}  // namespace spartan::program
