// The ground surface beneath rocks and above pits, fitted robustly to an elevation grid.
#pragma once

#include <cstdint>

#include "spartan/core/image.h"
#include "spartan/core/options.h"
#include "spartan/core/threads.h"

namespace spartan {

struct GroundSurfaceOptions {
  double window_m = 1.8;           ///< Diameter of the neighbourhood of one fit, m.
  double node_spacing_m = 0.2;     ///< Distance between the nodes at which the surface is fitted, m.
  double initial_scale_m = 0.12;   ///< Scale of the robust weights in the first weighted round, m.
  double final_scale_m = 0.03;     ///< Scale of the robust weights in the last round, m.
  double non_ground_weight = 0.2;  ///< Weight of cells that are not marked as ground; 1: the same as ground.

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("window_m", window_m,
            "Diameter of the neighbourhood to which the ground surface is fitted, in metres; raising it bridges larger "
            "rocks and follows the terrain less closely. It should be more than twice the size of the largest rock.",
            between(0.1, 100));
    v.renamed("lattice_m", "node_spacing_m");
    v.field("node_spacing_m", node_spacing_m,
            "Distance in metres between the nodes at which the ground surface is fitted; it is interpolated between "
            "them, and raising it is faster and coarser.",
            between(0.01, 10));
    v.renamed("coarse_m", "initial_scale_m");
    v.field(
        "initial_scale_m", initial_scale_m,
        "Scale of the Geman-McClure weights in the first weighted round, in metres: a cell with that residual has a "
        "quarter of the full weight; raising it helps on uneven ground.",
        between(0.001, 10));
    v.renamed("fine_m", "final_scale_m");
    v.field("final_scale_m", final_scale_m,
            "Scale of the Geman-McClure weights in the last round, in metres; raising it lets low rocks and shallow "
            "pits pull the surface.",
            between(0.001, 10));
    v.renamed("doubtful_weight", "non_ground_weight");
    v.field("non_ground_weight", non_ground_weight,
            "Weight of cells that v-disparity does not classify as ground, relative to ground cells; 0 excludes them.",
            between(0, 1));
  }
};

/// Fits a second-order surface to the cells around every node of a regular lattice by iteratively reweighted least
/// squares with Geman-McClure weights, w = 1/(1 + (r/s)²)², whose scale s falls from the initial to the final one
/// (graduated non-convexity), so that rocks and pits smaller than half of the window are outliers. Between the nodes
/// the surface is interpolated bilinearly. `elevation_m`: NaN where unknown. `ground`: not 0 where a cell is known to
/// be ground beforehand. The result has the size of `elevation_m`, in metres; NaN where fewer than six cells are near.
Image<float> fit_ground(ImageView<const float> elevation_m, ImageView<const std::uint8_t> ground, double cell_m,
                        const GroundSurfaceOptions& options, const ThreadPool& workers);

}  // namespace spartan
