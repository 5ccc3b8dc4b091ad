#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "spartan/figures/colours.h"
#include "spartan/figures/html.h"
#include "spartan/figures/plot.h"
#include "spartan/figures/plot_layout.h"

namespace spartan {
namespace {

using internal::PlotLayout;

constexpr std::size_t kMostPoints = 4000;  // of a line, drawn

std::string grid(const PlotLayout& l) {
  std::string svg = "<g class=\"ticks\">";
  for (const double v : internal::ticks_of(l.x, l.x_ticks())) {
    svg += fmt::format(
        "<path d=\"M{0:.1f} {1:.1f}V{2:.1f}\"/><text x=\"{0:.1f}\" y=\"{3:.1f}\" text-anchor=\"middle\">{4}</text>",
        l.px(v), l.top, l.top + l.height, l.top + l.height + 18, internal::tick_text(v));
  }
  for (const double v : internal::ticks_of(l.y, l.y_ticks())) {
    svg += fmt::format(
        "<path d=\"M{1:.1f} {0:.1f}H{2:.1f}\"/><text x=\"{3:.1f}\" y=\"{4:.1f}\" text-anchor=\"end\">{5}</text>",
        l.py(v), l.left, l.left + l.width, l.left - 6, l.py(v) + 4, internal::tick_text(v));
  }
  return svg + "</g>\n";
}

std::string stroke_of(const PlotLine& line, double width_px) {
  const std::string dash = line.dash_px > 0 ? fmt::format(" stroke-dasharray=\"{}\"", line.dash_px) : "";
  return fmt::format("stroke=\"{}\" stroke-width=\"{}\"{}", hex(line.colour), width_px, dash);
}

// In units of the axes, with y down.
std::string polyline(const PlotLine& line, std::size_t layer) {
  const std::size_t step = std::max<std::size_t>(1, (line.x.size() + kMostPoints - 1) / kMostPoints);
  std::string path;
  bool pen_down = false;
  for (std::size_t i = 0; i < line.x.size(); i += step) {
    const bool known = std::isfinite(line.x[i]) && std::isfinite(line.y[i]);
    if (known) path += fmt::format("{}{:.7g} {:.7g}", pen_down ? "L" : "M", line.x[i], -line.y[i]);
    pen_down = known;
  }
  return fmt::format(
      "<path class=\"line\" data-layer=\"{}\" d=\"{}\" fill=\"none\" {} vector-effect=\"non-scaling-stroke\"/>\n",
      layer, path, stroke_of(line, line.width_px));
}

std::string marker(const PlotMarker& m, const PlotLayout& l, std::size_t layer) {
  const std::string shape = m.heading_rad
                                ? fmt::format("<path d=\"M12 0L-7 -7L-3 0L-7 7Z\" transform=\"rotate({:.1f})\"/>",
                                              -*m.heading_rad * 180 / std::numbers::pi)
                                : std::string("<circle r=\"4\"/>");
  return fmt::format(
      "<g class=\"marker\" data-layer=\"{}\" data-x=\"{:.7g}\" data-y=\"{:.7g}\" transform=\"translate({:.1f} "
      "{:.1f})\" fill=\"{}\" stroke=\"#fff\">{}</g>\n",
      layer, m.x, m.y, l.px(m.x), l.py(m.y), hex(m.colour), shape);
}

std::string scale_bar(const PlotLayout& l) {
  const double length_m = internal::scale_bar_m(l), right = l.left + l.width - 12, y = l.top + l.height - 14;
  const double left = right - length_m / l.x.span() * l.width;
  return fmt::format(
      "<g class=\"scale\" data-right=\"{1:.1f}\" data-y=\"{2:.1f}\"><path d=\"M{0:.1f} "
      "{3:.1f}V{2:.1f}H{1:.1f}V{3:.1f}\"/><text x=\"{4:.1f}\" y=\"{5:.1f}\" text-anchor=\"middle\">{6} m</text></g>\n",
      left, right, y, y - 6, (left + right) / 2, y - 8, internal::tick_text(length_m));
}

std::string sample(const std::string& shape) {
  return "<svg viewBox=\"0 0 26 12\" width=\"26\" height=\"12\" aria-hidden=\"true\">" + shape + "</svg>";
}

std::string layer_key(const std::string& name, const std::string& shape, std::size_t layer) {
  return fmt::format("<button type=\"button\" class=\"key\" aria-pressed=\"true\" data-layer=\"{}\">{}{}</button>\n",
                     layer, sample(shape), html_text(name));
}

std::string legend(const Plot& plot, const internal::PlotLayers& layers) {
  std::string html = "<div class=\"legend\">";
  for (std::size_t i = 0; i < plot.lines.size(); ++i) {
    const PlotLine& line = plot.lines[i];
    html +=
        layer_key(line.name, fmt::format("<path d=\"M0 6H26\" {}/>", stroke_of(line, std::max(2.0, line.width_px))), i);
  }
  for (std::size_t i = 0; i < plot.markers.size(); ++i) {
    if (i > 0 && layers.markers[i] == layers.markers[i - 1]) continue;
    const PlotMarker& m = plot.markers[i];
    const char* const shape = m.heading_rad ? "<path d=\"M22 6L5 0L9 6L5 12Z\"" : "<circle cx=\"13\" cy=\"6\" r=\"4\"";
    html += layer_key(m.name, fmt::format("{} fill=\"{}\"/>", shape, hex(m.colour)), layers.markers[i]);
  }
  const auto box = [](const std::string& colour) {
    return fmt::format("<rect x=\"3\" width=\"20\" height=\"12\" fill=\"{}\"/>", colour);
  };
  if (plot.image) html += layer_key(plot.image->name, box("#8a8478"), layers.image);
  for (const ColourKey& k : plot.keys) {
    html += fmt::format("<span class=\"key\">{}{}</span>\n", sample(box(hex(k.colour))), html_text(k.name));
  }
  return html + "</div>\n";
}

}  // namespace

std::string to_html(const ColourBar& bar) {
  constexpr int kSteps = 24;
  constexpr double kWidth = 240;
  std::string svg = fmt::format(
      "<svg class=\"bar\" viewBox=\"-20 0 280 30\" width=\"280\" height=\"30\" role=\"img\" aria-label=\"{}: colours "
      "from {:.3g} to {:.3g}\">",
      html_text(bar.label), bar.range.low, bar.range.high);
  for (int i = 0; i < kSteps; ++i) {
    svg += fmt::format("<rect x=\"{:.1f}\" width=\"{:.1f}\" height=\"12\" fill=\"{}\"/>", i * kWidth / kSteps,
                       kWidth / kSteps + 0.5, hex(bar.colour((i + 0.5) / kSteps)));
  }
  for (const double v : internal::ticks_of(bar.range, 4)) {
    svg += fmt::format("<text x=\"{:.1f}\" y=\"26\" text-anchor=\"middle\">{}</text>",
                       (v - bar.range.low) / bar.range.span() * kWidth, internal::tick_text(v));
  }
  return "<div class=\"colours\"><span>" + html_text(bar.label) + "</span>" + svg + "</svg></div>\n";
}

std::string to_html(const Plot& plot) {
  const PlotLayout l = internal::layout_of(plot, 10);
  const internal::PlotLayers layers = internal::layers_of(plot);
  std::string html = fmt::format(
      "<figure class=\"plot\" style=\"max-width:{7:.0f}px\"{1}><figcaption>{2}</figcaption>\n{3}"
      "<svg class=\"chart\" viewBox=\"0 0 {0:.0f} {4:.0f}\" width=\"{0:.0f}\" height=\"{4:.0f}\" role=\"img\" "
      "aria-label=\"{2}; {5} over {6}\">\n",
      l.total_width, plot.equal_axes ? " data-equal=\"1\"" : "", html_text(plot.title), legend(plot, layers),
      l.total_height, html_text(plot.y_label), html_text(plot.x_label),
      plot.shown_px > 0 ? l.total_width * plot.shown_px / plot.width_px : l.total_width);
  html += grid(l);
  html += fmt::format(
      "<svg class=\"area\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" viewBox=\"{:.9g} {:.9g} {:.9g} "
      "{:.9g}\" preserveAspectRatio=\"none\">\n",
      l.left, l.top, l.width, l.height, l.x.low, -l.y.high, l.x.span(), l.y.span());
  if (plot.image) {
    const PlotImage& p = *plot.image;
    html += fmt::format(
        "<image data-layer=\"{}\" x=\"{:.7g}\" y=\"{:.7g}\" width=\"{:.7g}\" height=\"{:.7g}\" "
        "preserveAspectRatio=\"none\" href=\"{}\"/>\n",
        layers.image, p.x.low, -p.y.high, p.x.span(), p.y.span(), data_url(p.pixels.view()));
  }
  for (std::size_t i = 0; i < plot.lines.size(); ++i) html += polyline(plot.lines[i], i);
  html += "</svg>\n";
  for (std::size_t i = 0; i < plot.markers.size(); ++i) html += marker(plot.markers[i], l, layers.markers[i]);
  if (plot.equal_axes) html += scale_bar(l);
  html += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n", l.left + l.width / 2,
                      l.total_height - 8, html_text(plot.x_label));
  html += fmt::format("<text transform=\"translate(14 {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n</svg>\n",
                      l.top + l.height / 2, html_text(plot.y_label));
  if (plot.colour_bar) html += to_html(*plot.colour_bar);
  return html + "</figure>\n";
}

}  // namespace spartan
