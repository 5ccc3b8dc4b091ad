// Disparity merging: fuses the views of one stop into one panoramic range image.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/options.h"
#include "spartan/core/pose.h"
#include "spartan/core/threads.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan {

/// A camera with one projection centre and a field of view around its z axis. Azimuth φ = atan2(y, x) decreases by
/// equal steps from left to right. Rows are equal steps of slope z/√(x² + y²) on a cylinder, or of elevation angle on a
/// sphere.
class PanoramicCamera {
 public:
  enum class Projection { cylinder, sphere };
  friend constexpr auto enum_names(Projection) {
    return std::array{EnumName{Projection::cylinder, "cylinder"}, EnumName{Projection::sphere, "sphere"}};
  }

  PanoramicCamera() = default;
  /// `left_rad` and `top` (slope or elevation) are those of the centres of the first column and row; `per_radian` is
  /// the number of columns per radian, and of rows per unit of slope or per radian.
  PanoramicCamera(Projection projection, ImageSize size, double per_radian, double left_rad, double top);

  Projection projection() const { return projection_; }
  ImageSize size() const { return size_; }
  double per_radian() const { return per_radian_; }
  double left_rad() const { return left_rad_; }
  double top() const { return top_; }
  /// Pixel of a direction (not zero) in this camera's axes: x forward, y left, z up. It may lie outside of the image.
  /// None for directions straight up or down.
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& direction) const;
  /// Unit vector through a pixel.
  Eigen::Vector3d direction(double u, double v) const;

 private:
  Projection projection_ = Projection::cylinder;
  ImageSize size_;
  double per_radian_ = 1, left_rad_ = 0, top_ = 0;
};

/// Geometry and pose of a stereo pair for one view of a stop.
struct ViewGeometry {
  RectifiedStereo stereo;
  Pose body_from_left;  ///< Rectified left optical frame.
};

/// A rectangle of cells of a panoramic camera.
struct PanoramaWindow {
  int left = 0, top = 0;
  ImageSize size;
  bool contains(int x, int y) const { return x >= left && y >= top && x < left + size.width && y < top + size.height; }
};

/// The cells of a camera at `body_from_centre` that a view sees at depths between `nearest_m` and `farthest_m`.
PanoramaWindow window_of(const PanoramicCamera& camera, const Pose& body_from_centre, const ViewGeometry& view,
                         double nearest_m, double farthest_m);

/// The smallest panoramic camera at `body_from_centre` that contains everything the views see at depths between
/// `nearest_m` and `farthest_m` from their cameras.
PanoramicCamera plan_panorama(PanoramicCamera::Projection projection, double per_radian, const Pose& body_from_centre,
                              std::span<const ViewGeometry> views, double nearest_m, double farthest_m);

struct MergingOptions {
  PanoramicCamera::Projection projection = PanoramicCamera::Projection::sphere;  ///< Of the virtual camera.
  double pixels_per_degree = 14;    ///< Resolution of the virtual camera, pixels per degree of azimuth.
  double max_range_m = 6;           ///< Maximum range of a point from the virtual camera, m.
  double disparity_sigma_px = 0.3;  ///< Of the gate, at least; pixels.
  double gate_sigmas = 3;           ///< Gate on range differences, standard deviations.

  template <class Visitor>
  void describe(Visitor& v) {
    v.field(
        "projection", projection,
        "Projection of the virtual panoramic camera: rows of a sphere are equal steps of elevation angle, rows of a "
        "cylinder equal steps of slope; a cylinder has many more rows for the ground close to the rover and needs "
        "more memory and time.");
    v.field("pixels_per_degree", pixels_per_degree,
            "Resolution of the virtual panoramic camera in pixels per degree of azimuth; raising it keeps finer detail "
            "and costs memory and time.",
            between(0.5, 60));
    v.renamed("farthest_m", "max_range_m");
    v.field("max_range_m", max_range_m,
            "Maximum range of a point from the virtual camera in metres; farther points are discarded.",
            between(0.5, 10000));
    v.former("disparity_sigma_px", disparity_sigma_px, MergingOptions().disparity_sigma_px,
             "mapping.disparity_sigma_px", between(0.01, 5));
    v.field("gate_sigmas", gate_sigmas,
            "Gate on the difference of two ranges in standard deviations; ranges that differ by more belong to "
            "different surfaces, and raising it averages more of them.",
            between(1, 10));
  }
};

/// One view to be merged. All images are borrowed and of one size.
struct MergedView {
  ViewGeometry geometry;
  ImageView<const float> disparity;    ///< Pixels; NaN where unknown.
  ImageView<const float> sigma;        ///< Of the disparities, px; may be empty (MergingOptions::disparity_sigma_px).
  ImageView<const std::uint8_t> left;  ///< Gray levels of the rectified left image.
  ImageView<const std::uint8_t> classes;  ///< GroundClass of each pixel; may be empty (all 0).
};

/// The range image of the virtual panoramic camera, fused from all views.
struct MergedRange {
  PanoramicCamera camera;
  Pose body_from_centre;
  Image<float> range_m;         ///< Along the ray; NaN where unknown.
  Image<float> sigma_m;         ///< Standard deviation of the range.
  Image<std::uint8_t> views;    ///< Bit i: view i, i + 8, i + 16 … contributed.
  Image<std::uint8_t> gray;     ///< Mean gray level, weighted by the ranges' inverse variances.
  Image<std::uint8_t> classes;  ///< Majority GroundClass of the view with the most pixels in the cell.
  Image<float> baseline_m;      ///< Of the pair that sees the cell, the longest of several.
  /// Not 0 at the upper border of what the views cover: no view looks half a degree above the cell, or what it sees
  /// there is beyond the largest range. Empty: nowhere.
  Image<std::uint8_t> truncated;
};

/// Fuses the views of one stop. Every pixel of every view is rasterized into the virtual camera by one 4×4 matrix per
/// view, which the fixed geometry gives: with disparity d, (X, Y, Z, W)ᵀ = M (u, v, d, 1)ᵀ. Pixels of one view that
/// fall into one cell and belong to one surface are averaged; of two surfaces the nearer one is retained. Views agree
/// where their ranges differ by less than the gate; their ranges are then averaged with inverse-variance weights. Where
/// views disagree, the nearer surface is retained unless more views see free space through it than see it, so that a
/// doubtful cell counts as an obstacle. Empty cells between two cells of one surface are interpolated. Derivation:
/// docs/math/stereo.md.
class DisparityMerger {
 public:
  /// Any number of views. `nearest_m`: nearest depth that the
  /// virtual camera covers. Code `configuration` where an option is out of bounds.
  static Result<DisparityMerger> create(const MergingOptions& options, const Pose& body_from_centre,
                                        std::span<const ViewGeometry> views, double nearest_m, ThreadPool workers);

  /// Views in the order and with the geometry of create(); a view with an empty disparity image is skipped.
  MergedRange merge(std::span<const MergedView> views) const;

  const PanoramicCamera& camera() const { return camera_; }

 private:
  DisparityMerger(const MergingOptions& options, const Pose& body_from_centre, std::span<const ViewGeometry> views,
                  double nearest_m, ThreadPool workers);

  struct Projection;
  struct Layer;
  struct Fused {
    MergedRange& range;
    Image<float>& gates_m;        // largest difference of ranges of one surface
    Image<std::uint8_t>& beyond;  // 1: a view sees a surface beyond the largest range
  };
  Projection project(const MergedView& view) const;
  void rasterize(const MergedView& view, const Projection& projection, Layer& layer) const;
  void fuse_row(std::span<const MergedView> views, std::span<const Layer> layers, int row, const Fused& to) const;
  void fill_bands(std::span<const MergedView> views, const Fused& fused) const;
  Image<std::uint8_t> upper_border(std::span<const MergedView> views, const Image<std::uint8_t>& beyond,
                                   const Image<float>& range_m) const;

  MergingOptions options_;
  double nearest_m_;
  Pose body_from_centre_;
  PanoramicCamera camera_;
  ThreadPool workers_;
};

}  // namespace spartan
