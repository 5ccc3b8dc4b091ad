// Options of the disparity computation.
#pragma once

#include <string>

#include "spartan/core/options.h"
#include "spartan/reconstruction/disparity_computer.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan {

/// Costs are Hamming distances of 62-bit census signatures (0 … 62). Semi-global matching penalises a disparity step of
/// one pixel by p1, a larger one by p2, which falls from p2_flat to p2_edge as the gray level changes along the path:
///   p2(ΔI) = max(p2_edge, p2_flat / (1 + |ΔI| / p2_falloff_levels)).
struct DisparityOptions {
  int p1 = 36;
  int p2_flat = 180;
  int p2_edge = 50;
  double p2_falloff_levels = 10;
  int out_of_view_cost = 22;
  double uniqueness_percent = 0;
  double left_right_px = 4;
  bool median = true;
  int speckle_size_px = 100;
  double speckle_step_px = 2;
  std::string simd = "auto";

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("p1", p1, "penalty for a disparity step of one pixel", between(0, 60));
    v.field("p2_flat", p2_flat, "penalty for a larger step where the gray level stays", between(1, 190));
    v.field("p2_edge", p2_edge, "the least penalty for a larger step", between(1, 190));
    v.field("p2_falloff_levels", p2_falloff_levels, "gray-level change that halves the penalty", between(0.1, 1000));
    v.field("out_of_view_cost", out_of_view_cost, "cost of disparities that leave the right image", between(0, 62));
    v.field("uniqueness_percent", uniqueness_percent, "the runner-up must cost so much more; 0: no check",
            between(0, 100));
    v.field("left_right_px", left_right_px,
            "a right pixel belongs to the cheapest left pixel that claims it; others go where they differ by more; "
            "negative: no "
            "check");
    v.field("median", median, "3x3 median over the disparities");
    v.field("speckle_size_px", speckle_size_px, "smaller patches are dropped; 0: none", at_least(0));
    v.field("speckle_step_px", speckle_step_px, "neighbours that differ by less belong to one patch", at_least(0));
    v.field("simd", simd, "instruction set; the result is the same, bit for bit", {"auto", "sse4", "avx2", "avx3"});
  }
};

/// The range that a pair needs: from 0 to f b / nearest_m, or to a quarter of the width where that is not stated (the
/// rig's search range, design of the published rover), rounded up so that the count is a multiple of 16.
DisparityRange disparity_range(const RectifiedStereo& geometry, double nearest_m);

}  // namespace spartan
