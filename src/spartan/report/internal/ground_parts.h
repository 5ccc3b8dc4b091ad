// What the parts of the ground figure share.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "spartan/figures/drawing.h"
#include "spartan/rig_design/rig_designer.h"

namespace spartan::internal {

using Point = Eigen::Vector2d;
using Points = Drawing::Points;

constexpr int kWidth_px = 1200;
constexpr double kMargin_px = 40;

/// Colors for color-blind readers (Okabe and Ito), lighter where fewer cameras see.
inline constexpr Rgb8 kInk{30, 30, 30}, kFaint{150, 150, 150}, kSoil{120, 100, 80}, kUnseen{222, 222, 222};
inline constexpr Rgb8 kFirstPair{0, 114, 178}, kFirstPairOneCamera{200, 226, 243}, kFirstPairBoth{134, 187, 222},
    kFirstPairTwice{58, 134, 188};
inline constexpr Rgb8 kShared{0, 158, 115};
/// Of the pairs beside the first one; they repeat.
inline constexpr std::array<Rgb8, 4> kOtherPairs{{{213, 94, 0}, {204, 121, 167}, {230, 159, 0}, {90, 90, 90}}};

/// One pair as it is drawn.
struct DrawnPair {
  std::string name;
  Rgb8 colour;
  const PairRequirements& requirements;
  const PairMetrics& figures;
  GroundView view() const { return ground_view(figures, requirements); }
};

/// Metres of a plane into pixels: `right` and `up` of the plane's axes.
struct Scale {
  Point origin;
  double px_per_m;
  Point operator()(double right_m, double up_m) const {
    return {origin.x() + right_m * px_per_m, origin.y() - up_m * px_per_m};
  }
};

/// Ticks of a scale up to `to_m`, in round steps that leave room for labels.
std::vector<double> marks(double px_per_m, double to_m);
/// The way around, back to the first point.
Points closed(Points points);

}  // namespace spartan::internal
