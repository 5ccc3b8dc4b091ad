// Speeded-up robust features (SURF).
// Source: Bay, Ess, Tuytelaars, Van Gool, "Speeded-Up Robust Features (SURF)", CVIU 110 (2008) 346-359.
#pragma once

#include <vector>

#include "spartan/odometry/internal/detection/integral_image.h"
#include "spartan/odometry/internal/detection/landmark_detector.h"
#include "spartan/odometry/internal/detection/surf_refinement.h"

namespace spartan::internal {

/// Detects blobs as maxima of the determinant of the Hessian over position and scale, with second derivatives from box
/// filters on the integral image (§3), and describes them by sums of Haar wavelet responses (§4).
class SurfDetector final : public LandmarkDetector {
 public:
  SurfDetector(const DetectionOptions& options, ThreadPool workers);
  using LandmarkDetector::detect;
  const std::vector<Feature>& detect(ImageView<const std::uint8_t> image, ImageView<const std::uint8_t> mask,
                                     const WantedFeatures& wanted) override;

 private:
  struct Range {
    int first, last;
    bool contains(int i) const { return i >= first && i <= last; }
  };
  /// A horizontal part of the image, searched row by row.
  struct Part {
    Image<float> rows;         ///< det H in three consecutive rows of each layer of the octave
    std::vector<int> columns;  ///< of the maxima within a row
    std::vector<Feature> found;
  };
  static Range range_of(int octave, int layer, int length);
  void compute_row(int octave, int y, ImageSize size, Image<float>& rows) const;
  void find_maxima(int octave, int y, ImageSize size, Part& part) const;
  void search(int index, ImageSize size, Part& part) const;
  void refine(ImageView<const std::uint8_t> image, ImageView<const std::uint8_t> mask, int count,
              const WantedFeatures& wanted);

  DetectionOptions options_;
  ThreadPool workers_;
  IntegralImage integral_;
  SurfRefinement refinement_;
  std::vector<Part> parts_;
  std::vector<Feature> found_, features_;
};

/// Box-filter approximation of the Hessian at one pixel, divided by the filter's area (§3.2), with lobes of
/// filter_px/3. The filter must lie inside the image with a margin of one pixel.
struct BoxHessian {
  float xx = 0, yy = 0, xy = 0;
  /// Dxx Dyy − (0.9 Dxy)² (eq. 3).
  float determinant() const { return xx * yy - 0.81f * xy * xy; }
};
BoxHessian box_hessian(const IntegralImage& integral, int x, int y, int filter_px);

/// Orientation of a feature: direction of the largest sum of Haar responses in a sliding window of π/3 (§4.1), rad.
float surf_orientation(const IntegralImage& integral, const Feature& feature);

/// 4×4 subregions of 5×5 Haar responses over a square of side 20 s, each summed as (Σdx, Σ|dx|, Σdy, Σ|dy|), normalized
/// to unit length (§4.2).
Descriptor surf_descriptor(const IntegralImage& integral, const Feature& feature);

/// Entries of a SURF descriptor.
enum class SurfEntries : std::uint8_t {
  sums,   ///< as published
  roots,  ///< square roots with the sign of the sums: large sums dominate distances less (as Arandjelović, Zisserman,
          ///< "Three things everyone should know to improve object retrieval", CVPR 2012, for SIFT)
};
Descriptor surf_descriptor(const IntegralImage& integral, const Feature& feature, SurfEntries entries);

}  // namespace spartan::internal
