#include <algorithm>
#include <cmath>
#include <utility>

#include "spartan/figures/drawing.h"
#include "spartan/figures/plot.h"
#include "spartan/figures/plot_layout.h"

namespace spartan {
namespace {

using internal::PlotLayout;
using Points = Drawing::Points;

constexpr Rgb8 kInk{30, 30, 30}, kGrid{225, 225, 225}, kFrame{120, 120, 120};
constexpr double kAbove_px = 54, kKey_px = 22, kLetter_px = 13;

Points box(double left, double top, double right, double bottom) {
  return {{left, top}, {right, top}, {right, bottom}, {left, bottom}, {left, top}};
}

void draw_axes(Drawing& d, const Plot& plot, const PlotLayout& l) {
  const double bottom = l.top + l.height, right = l.left + l.width;
  for (const double v : internal::ticks_of(l.x, l.x_ticks())) {
    d.line({{l.px(v), l.top}, {l.px(v), bottom}}, {kGrid, 1});
    d.text({l.px(v), bottom + 17}, internal::tick_text(v), {kInk, kLetter_px, Anchor::middle});
  }
  for (const double v : internal::ticks_of(l.y, l.y_ticks())) {
    d.line({{l.left, l.py(v)}, {right, l.py(v)}}, {kGrid, 1});
    d.text({l.left - 6, l.py(v) + 4}, internal::tick_text(v), {kInk, kLetter_px, Anchor::end});
  }
  d.text({l.left + l.width / 2, l.total_height - 10}, plot.x_label, {kInk, kLetter_px, Anchor::middle});
  // Without rotated text: the label of the y axis stands above it.
  d.text({8, l.top - 6}, plot.y_label, {kInk, kLetter_px});
}

void draw_line(Drawing& d, const PlotLine& line, const PlotLayout& l) {
  Points points;
  const auto finish = [&] {
    if (points.size() > 1) d.line(points, {line.colour, line.width_px, line.dash_px});
    points.clear();
  };
  for (std::size_t i = 0; i < line.x.size(); ++i) {
    if (std::isfinite(line.x[i]) && std::isfinite(line.y[i])) {
      points.emplace_back(l.px(line.x[i]), l.py(line.y[i]));
    } else {
      finish();
    }
  }
  finish();
}

Points arrow_at(const Eigen::Vector2d& at, double heading_rad) {
  const Eigen::Vector2d ahead(std::cos(heading_rad), -std::sin(heading_rad)), aside(-ahead.y(), ahead.x());
  return {at + 12 * ahead, at - 7 * ahead - 7 * aside, at - 3 * ahead, at - 7 * ahead + 7 * aside};
}

Points dot_at(const Eigen::Vector2d& at) {
  Points corners;
  for (int i = 0; i < 16; ++i)
    corners.emplace_back(at + 4 * Eigen::Vector2d(std::cos(i * 0.3927), std::sin(i * 0.3927)));
  return corners;
}

void draw_marker(Drawing& d, const PlotMarker& m, const Eigen::Vector2d& at) {
  d.fill(m.heading_rad ? arrow_at(at, *m.heading_rad) : dot_at(at), {m.colour});
}

void draw_scale_bar(Drawing& d, const PlotLayout& l) {
  const double length_m = internal::scale_bar_m(l), right = l.left + l.width - 12, y = l.top + l.height - 14;
  const double left = right - length_m / l.x.span() * l.width;
  const Points bar{{left, y - 6}, {left, y}, {right, y}, {right, y - 6}};
  d.line(bar, {{255, 255, 255}, 5});
  d.line(bar, {kInk, 2});
  d.text({(left + right) / 2, y - 8}, internal::tick_text(length_m) + " m", {kInk, kLetter_px, Anchor::middle, true});
}

// What one row of the legend shows, with the width of its letters.
class Legend {
 public:
  Legend(Drawing& drawing, double top, double left, double right)
      : drawing_(drawing), x_(left), y_(top + 14), left_(left), right_(right) {}

  // Where the sample of the next entry is drawn.
  Eigen::Vector2d next(const std::string& name) {
    const double width = 34 + 7.3 * static_cast<double>(name.size());
    if (x_ > left_ && x_ + width > right_) {
      x_ = left_;
      y_ += kKey_px;
    }
    Eigen::Vector2d at(x_ + 12, y_ - 4);
    drawing_.text({x_ + 30, y_}, name, {kInk, kLetter_px});
    x_ += width + 14;
    return at;
  }
  double bottom() const { return y_ + 8; }

 private:
  Drawing& drawing_;
  double x_, y_, left_, right_;
};

void draw_keys(Drawing& d, const std::vector<ColourKey>& keys, Legend& legend) {
  for (const ColourKey& key : keys) {
    const Eigen::Vector2d at = legend.next(key.name);
    d.fill(box(at.x() - 10, at.y() - 6, at.x() + 10, at.y() + 6), {key.colour});
  }
}

double draw_legend(Drawing& d, const Plot& plot, const PlotLayout& l) {
  Legend legend(d, l.total_height, 12, l.total_width - 8);
  for (const PlotLine& line : plot.lines) {
    const Eigen::Vector2d at = legend.next(line.name);
    d.line({{at.x() - 12, at.y()}, {at.x() + 12, at.y()}}, {line.colour, std::max(2.0, line.width_px), line.dash_px});
  }
  for (std::size_t i = 0; i < plot.markers.size(); ++i) {
    const PlotMarker& m = plot.markers[i];
    if (i > 0 && plot.markers[i - 1].name == m.name) continue;
    PlotMarker sample = m;
    if (m.heading_rad) sample.heading_rad = 0;
    draw_marker(d, sample, legend.next(m.name));
  }
  draw_keys(d, plot.keys, legend);
  return plot.lines.empty() && plot.markers.empty() && plot.keys.empty() ? l.total_height : legend.bottom();
}

double draw_colour_bar(Drawing& d, const ColourBar& bar, double top) {
  constexpr int kSteps = 48;
  constexpr double kLeft = 24, kWidth = 260, kHeight = 12;
  for (int i = 0; i < kSteps; ++i) {
    d.fill(box(kLeft + i * kWidth / kSteps, top, kLeft + (i + 1) * kWidth / kSteps, top + kHeight),
           {bar.colour((i + 0.5) / kSteps)});
  }
  for (const double v : internal::ticks_of(bar.range, 4)) {
    d.text({kLeft + (v - bar.range.low) / bar.range.span() * kWidth, top + kHeight + 16}, internal::tick_text(v),
           {kInk, kLetter_px, Anchor::middle});
  }
  d.text({kLeft + kWidth + 20, top + kHeight - 1}, bar.label, {kInk, kLetter_px});
  return top + kHeight + 26;
}

}  // namespace

Image<Rgb8> to_image(const Plot& plot) {
  const PlotLayout l = internal::layout_of(plot, kAbove_px);
  Drawing d(static_cast<int>(std::lround(l.total_width)), 0);
  d.text({12, 22}, plot.title, {kInk, 16});
  draw_axes(d, plot, l);
  if (plot.image) {
    const PlotImage& p = *plot.image;
    d.image({l.px(p.x.low), l.py(p.y.high)}, {l.px(p.x.high), l.py(p.y.low)}, Image<Rgb8>::copy_of(p.pixels.view()));
  }
  for (const PlotLine& line : plot.lines) draw_line(d, line, l);
  for (const PlotMarker& m : plot.markers) draw_marker(d, m, {l.px(m.x), l.py(m.y)});
  d.line(box(l.left, l.top, l.left + l.width, l.top + l.height), {kFrame, 1});
  if (plot.equal_axes) draw_scale_bar(d, l);
  double bottom = draw_legend(d, plot, l);
  if (plot.colour_bar) bottom = draw_colour_bar(d, *plot.colour_bar, bottom + 6);
  d.set_height(static_cast<int>(std::ceil(bottom)));
  return d.to_image();
}

Image<Rgb8> titled_image(Image<Rgb8> pixels, const std::string& title, const std::vector<ColourKey>& keys) {
  constexpr int kTitle_px = 36, kLeastWidth_px = 420;
  const double width = pixels.width(), bottom = kTitle_px + pixels.height();
  Drawing d(std::max(pixels.width(), kLeastWidth_px), 0);
  d.text({12, 22}, title, {kInk, 16});
  d.image({0, kTitle_px}, {width, bottom}, std::move(pixels));
  Legend legend(d, bottom + 8, 12, std::max(width, double{kLeastWidth_px}) - 8);
  draw_keys(d, keys, legend);
  d.set_height(static_cast<int>(std::ceil(keys.empty() ? bottom : legend.bottom())));
  return d.to_image();
}

}  // namespace spartan
