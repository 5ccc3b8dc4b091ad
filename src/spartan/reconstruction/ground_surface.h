// The ground under what stands on it.
#pragma once

#include <cstdint>

#include "spartan/core/image.h"
#include "spartan/core/options.h"
#include "spartan/core/threads.h"

namespace spartan {

struct GroundSurfaceOptions {
  double window_m = 1.8;
  double lattice_m = 0.2;
  double coarse_m = 0.12;
  double fine_m = 0.03;
  double doubtful_weight = 0.2;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("window_m", window_m, "the ground is smooth over this", between(0.1, 100));
    v.field("lattice_m", lattice_m, "from place to place where it is fitted", between(0.01, 10));
    v.field("coarse_m", coarse_m, "cells so far off count half at first", between(0.001, 10));
    v.field("fine_m", fine_m, "and in the end", between(0.001, 10));
    v.field("doubtful_weight", doubtful_weight, "of cells that v-disparity does not call ground", between(0, 1));
  }
};

/// At every place of a lattice a surface of second order is fitted to the cells around by least squares that are
/// weighted anew (Geman-McClure: w = 1/(1 + (r/s)²)², s falling from coarse to fine), so that rocks and pits, less than
/// half of the window, do not count; between the places it is interpolated. `elevation_m`: NaN unknown. `ground`: not 0
/// where a cell is taken for ground beforehand. NaN where fewer than six cells are near.
Image<float> fit_ground(ImageView<const float> elevation_m, ImageView<const std::uint8_t> ground, double cell_m,
                        const GroundSurfaceOptions& options, const Workers& workers);

}  // namespace spartan
