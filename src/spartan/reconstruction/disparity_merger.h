// Disparity merging: the published sub-module that joins the views of one rover position.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/options.h"
#include "spartan/core/threads.h"
#include "spartan/reconstruction/panoramic_camera.h"

namespace spartan {

struct MergingOptions {
  std::string projection = "cylinder";
  double pixels_per_degree = 12;
  double farthest_m = 6;
  double disparity_sigma_px = 0.3;
  double gate_sigmas = 3;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("projection", projection, "of the virtual camera", {"cylinder", "sphere"});
    v.field("pixels_per_degree", pixels_per_degree, "of the virtual camera", between(0.5, 60));
    v.field("farthest_m", farthest_m, "points farther away are left out", between(0.5, 10000));
    v.field("disparity_sigma_px", disparity_sigma_px, "standard deviation of a disparity", between(0.01, 5));
    v.field("gate_sigmas", gate_sigmas, "ranges that differ by more belong to different surfaces", between(1, 10));
  }
};

/// One view that is merged. Everything is borrowed.
struct MergedView {
  ViewGeometry geometry;
  ImageView<const float> disparity;       ///< px, NaN unknown
  ImageView<const std::uint8_t> left;     ///< gray levels of the rectified left image
  ImageView<const std::uint8_t> classes;  ///< per pixel, handed through by majority; may be empty (all 0)
};

/// The ground as seen from one point by all views together.
struct MergedRange {
  PanoramicCamera camera;
  Pose body_from_centre;
  Image<float> range_m;         ///< along the ray; NaN unknown
  Image<float> sigma_m;         ///< standard deviation of the range
  Image<std::uint8_t> views;    ///< bit i: view i, i + 8, i + 16 … is in it
  Image<std::uint8_t> gray;     ///< mean gray level
  Image<std::uint8_t> classes;  ///< of the view with the most pixels there
};

/// Every pixel of every view is thrown into the virtual camera by one matrix a view, made from the fixed geometry: with
/// disparity d, (X, Y, Z, W)ᵀ = M (u, v, d, 1)ᵀ. Pixels of one view that share a cell and a surface are averaged; of
/// two surfaces the nearer stays. Views agree where their ranges differ by less than the gate: then they are weighted
/// by their variances. Where they do not, the nearer surface stands unless more views look right through it than see
/// it: in doubt there is an obstacle. Cells that no pixel met between two of one surface are filled.
class DisparityMerger {
 public:
  /// Any number of views; merge() holds one layer of the panorama's size for each.
  DisparityMerger(const MergingOptions& options, const Pose& body_from_centre, std::span<const ViewGeometry> views,
                  double nearest_m, Workers workers);

  /// Views in the order and with the geometry of the constructor; one without disparities (empty) is left out.
  MergedRange merge(std::span<const MergedView> views) const;

  const PanoramicCamera& camera() const { return camera_; }

 private:
  struct Layer;
  void throw_into(const MergedView& view, Layer& layer) const;
  void fuse_row(std::span<const MergedView> views, std::span<const Layer> layers, int row, MergedRange& merged) const;

  MergingOptions options_;
  Pose body_from_centre_;
  PanoramicCamera camera_;
  Workers workers_;
};

}  // namespace spartan
