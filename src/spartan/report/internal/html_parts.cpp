#include "spartan/report/internal/html_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "spartan/image_io/image_io.h"

namespace spartan::internal {
namespace {

std::string base64(const std::string& bytes) {
  constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve(bytes.size() * 4 / 3 + 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&](std::size_t k) {
      return k < bytes.size() ? static_cast<unsigned>(static_cast<unsigned char>(bytes[k])) : 0U;
    };
    const unsigned block = byte(i) << 16U | byte(i + 1) << 8U | byte(i + 2);
    text += kDigits[block >> 18U & 63U];
    text += kDigits[block >> 12U & 63U];
    text += i + 1 < bytes.size() ? kDigits[block >> 6U & 63U] : '=';
    text += i + 2 < bytes.size() ? kDigits[block & 63U] : '=';
  }
  return text;
}

std::string figure(const Result<std::string>& png, const std::string& caption, int width_px) {
  if (!png) return "<p>" + html_text(png.error().message()) + "</p>";
  return fmt::format(
      "<figure style=\"width:{1}px\"><img alt=\"{0}\" width=\"{1}\" "
      "src=\"data:image/png;base64,{2}\"><figcaption>{0}</figcaption></figure>\n",
      html_text(caption), width_px, base64(*png));
}

template <class Pixel, class Sum>
Image<Pixel> shrink(ImageView<const Pixel> image, int width, const Sum& mean_of) {
  const int block = std::max(1, (image.width() + width - 1) / width);
  Image<Pixel> small(image.width() / block, image.height() / block);
  for (int y = 0; y < small.height(); ++y) {
    for (int x = 0; x < small.width(); ++x) small(x, y) = mean_of(image.crop(x * block, y * block, block, block));
  }
  return small;
}

// A round step that gives about five ticks.
double step_for(double span) {
  const double raw = std::max(span, 1e-12) / 5, power = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (raw <= factor * power) return factor * power;
  }
  return 10 * power;
}

struct Range {
  double low = 0, high = 1;
  double span() const { return high - low; }
};

Range range_of(const std::vector<PlotLine>& lines, bool vertical) {
  Range range{1e300, -1e300};
  for (const PlotLine& line : lines) {
    for (const double v : vertical ? line.y : line.x) range = {std::min(range.low, v), std::max(range.high, v)};
  }
  if (range.low > range.high) return {};
  const double margin = std::max(0.05 * range.span(), 1e-9);
  return {range.low - margin, range.high + margin};
}

void widen(Range& range, double span) {
  const double more = (span - range.span()) / 2;
  range = {range.low - more, range.high + more};
}

}  // namespace

std::string html_text(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    switch (c) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '"':
        safe += "&quot;";
        break;
      default:
        safe += c;
    }
  }
  return safe;
}

std::string html_image(ImageView<const std::uint8_t> image, const std::string& caption, int width_px) {
  return figure(encode_png(image), caption, width_px);
}
std::string html_image(ImageView<const Rgb8> image, const std::string& caption, int width_px) {
  return figure(encode_png(image), caption, width_px);
}

Image<std::uint8_t> shrunk(ImageView<const std::uint8_t> image, int width) {
  return shrink(image, width, [](ImageView<const std::uint8_t> block) {
    int sum = 0;
    for (int y = 0; y < block.height(); ++y) {
      for (int x = 0; x < block.width(); ++x) sum += block(x, y);
    }
    return static_cast<std::uint8_t>(sum / (block.width() * block.height()));
  });
}

Image<Rgb8> shrunk(ImageView<const Rgb8> image, int width) {
  return shrink(image, width, [](ImageView<const Rgb8> block) {
    std::array<int, 3> sum{};
    const int count = block.width() * block.height();
    for (int y = 0; y < block.height(); ++y) {
      for (int x = 0; x < block.width(); ++x) {
        sum[0] += block(x, y).r;
        sum[1] += block(x, y).g;
        sum[2] += block(x, y).b;
      }
    }
    return Rgb8{static_cast<std::uint8_t>(sum[0] / count), static_cast<std::uint8_t>(sum[1] / count),
                static_cast<std::uint8_t>(sum[2] / count)};
  });
}

Rgb8 cold_to_hot(double value) {
  const double v = std::clamp(value, 0.0, 1.0);
  const auto level = [](double part) {
    return static_cast<std::uint8_t>(std::lround(255 * std::clamp(part, 0.0, 1.0)));
  };
  return v < 0.5 ? Rgb8{level(0.2 + 1.6 * v), level(0.35 + 1.3 * v), level(0.75 + 0.5 * v)}
                 : Rgb8{level(1.1 - 0.3 * (v - 0.5)), level(1 - 1.6 * (v - 0.5)), level(1 - 1.9 * (v - 0.5))};
}

std::string svg_plot(const std::vector<PlotLine>& lines, const PlotOptions& o) {
  constexpr int kLeft = 64, kBottom = 44, kTop = 12, kRight = 12;
  const int w = o.width_px - kLeft - kRight, h = o.height_px - kTop - kBottom;
  Range x = range_of(lines, false), y = range_of(lines, true);
  if (o.equal_axes) {
    const double per_px = std::max(x.span() / w, y.span() / h);
    widen(x, per_px * w);
    widen(y, per_px * h);
  }
  const auto px = [&](double v) { return kLeft + (v - x.low) / x.span() * w; };
  const auto py = [&](double v) { return kTop + (y.high - v) / y.span() * h; };
  std::string svg =
      fmt::format("<svg viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" role=\"img\">\n", o.width_px, o.height_px);
  for (double v = std::ceil(x.low / step_for(x.span())) * step_for(x.span()); v <= x.high; v += step_for(x.span())) {
    svg += fmt::format(
        "<line class=\"grid\" x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\"/><text x=\"{0:.1f}\" y=\"{3}\" "
        "text-anchor=\"middle\">{4:.4g}</text>\n",
        px(v), kTop, kTop + h, kTop + h + 16, std::abs(v) < 1e-12 ? 0.0 : v);
  }
  for (double v = std::ceil(y.low / step_for(y.span())) * step_for(y.span()); v <= y.high; v += step_for(y.span())) {
    svg += fmt::format(
        "<line class=\"grid\" x1=\"{1}\" x2=\"{2}\" y1=\"{0:.1f}\" y2=\"{0:.1f}\"/><text x=\"{3}\" y=\"{4:.1f}\" "
        "text-anchor=\"end\">{5:.4g}</text>\n",
        py(v), kLeft, kLeft + w, kLeft - 6, py(v) + 4, std::abs(v) < 1e-12 ? 0.0 : v);
  }
  int row = 0;
  for (const PlotLine& line : lines) {
    std::string points;
    for (std::size_t i = 0; i < line.x.size(); ++i)
      points += fmt::format("{:.1f},{:.1f} ", px(line.x[i]), py(line.y[i]));
    svg +=
        fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"/>\n", points, line.colour);
    svg += fmt::format("<text x=\"{}\" y=\"{}\" style=\"fill:{}\" class=\"key\">{}</text>\n", kLeft + 10,
                       kTop + 16 + 16 * row++, line.colour, html_text(line.name));
  }
  svg += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n", kLeft + w / 2, o.height_px - 8,
                     html_text(o.x_label));
  svg += fmt::format("<text transform=\"translate(14 {}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n</svg>\n",
                     kTop + h / 2, html_text(o.y_label));
  return svg;
}

std::string html_table(const std::vector<std::vector<std::string>>& rows) {
  std::string table = "<table>\n";
  for (std::size_t i = 0; i < rows.size(); ++i) {
    table += "<tr>";
    for (const std::string& cell : rows[i])
      table += fmt::format("<{0}>{1}</{0}>", i == 0 ? "th" : "td", html_text(cell));
    table += "</tr>\n";
  }
  return table + "</table>\n";
}

std::string html_page(const std::string& title, const std::string& body) {
  return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>" + html_text(title) + R"(</title>
<link rel="icon" href="data:,">
<style>
body { font: 16px/1.5 system-ui, sans-serif; max-width: 1160px; margin: 2rem auto; padding: 0 1rem; color: #2b2320; background: #fbf7f2; }
h1 { color: #9a3b12; } h2 { border-bottom: 1px solid #dcc7b4; margin-top: 2.2rem; }
figure { display: inline-block; max-width: 100%; margin: 0 10px 12px 0; vertical-align: top; }
figcaption { font-size: 13px; color: #6b5a4e; }
img { max-width: 100%; height: auto; border-radius: 4px; }
table { border-collapse: collapse; margin: 1rem 0; }
th, td { padding: 4px 14px; text-align: right; border-bottom: 1px solid #e6d7c8; }
th:first-child, td:first-child { text-align: left; }
svg { background: #fff; border-radius: 4px; margin: 0 12px 12px 0; } svg text { font-size: 12px; fill: #4c4038; } svg .key { font-weight: 600; }
.grid { stroke: #eee3d8; }
.figures b { font-size: 1.5rem; display: block; } .figures div { display: inline-block; margin-right: 2.5rem; }
</style></head><body>
)" + body +
         "</body></html>\n";
}

}  // namespace spartan::internal
