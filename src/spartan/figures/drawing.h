// A vector drawing that can be written as SVG or rendered to pixels.
#pragma once

#include <Eigen/Core>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "spartan/core/image.h"

namespace spartan {

struct Paint {
  Rgb8 colour;
  double opacity = 1;
};
struct Pen {
  Rgb8 colour;
  double width_px = 1;
  double dash_px = 0;  ///< length of dashes and gaps; 0: a solid line
};
enum class Anchor { start, middle, end };
struct Lettering {
  Rgb8 colour;
  double size_px = 14;
  Anchor anchor = Anchor::start;
  bool halo = false;  ///< white outline, for text on colours
};

/// Coordinates in pixels of the result, x right, y down. Later parts cover earlier ones.
class Drawing {
 public:
  using Points = std::vector<Eigen::Vector2d>;

  Drawing(int width_px, int height_px) : width_px_(width_px), height_px_(height_px) {}

  /// Of the result: known late where text decides it.
  void set_height(int height_px) { height_px_ = height_px; }

  void fill(Points corners, const Paint& paint) { parts_.emplace_back(Area{std::move(corners), paint}); }
  void line(Points points, const Pen& pen) { parts_.emplace_back(Line{std::move(points), pen}); }
  /// One line of text, anchored at `foot` on its baseline. ASCII and the degree sign.
  void text(const Eigen::Vector2d& foot, const std::string& text, const Lettering& lettering) {
    parts_.emplace_back(Text{foot, text, lettering});
  }

  /// An image whose corner pixels fill the corners of a rectangle from `top_left` to `bottom_right`.
  void image(const Eigen::Vector2d& top_left, const Eigen::Vector2d& bottom_right, Image<Rgb8> pixels) {
    parts_.emplace_back(PlacedImage{top_left, bottom_right, std::move(pixels)});
  }

  std::string to_svg() const;
  Image<Rgb8> to_image() const;

 private:
  struct Area {
    Points corners;
    Paint paint;
  };
  struct Line {
    Points points;
    Pen pen;
  };
  struct Text {
    Eigen::Vector2d foot;
    std::string text;
    Lettering lettering;
  };
  struct PlacedImage {
    Eigen::Vector2d top_left, bottom_right;
    Image<Rgb8> pixels;
  };
  using Part = std::variant<Area, Line, Text, PlacedImage>;

  int width_px_, height_px_;
  std::vector<Part> parts_;
};

}  // namespace spartan
