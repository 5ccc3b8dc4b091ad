// Sub-pixel refinement of a disparity image: smoothing by pairs of neighbours, one step of least squares on the right
// image warped by the smoothed disparities, and smoothing weighted by the information of the fit. Derivation:
// docs/math/stereo.md.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/threads.h"
#include "spartan/reconstruction/internal/matching/refinement_kernels.h"
#include "spartan/reconstruction/internal/matching/row_padding.h"
#include "spartan/reconstruction/internal/matching/texture_support.h"

namespace spartan::internal::matching {

class SubpixelRefinement {
 public:
  SubpixelRefinement(RefinementKernels kernels, const ThreadPool& workers);

  /// Makes the images below.
  void resize(ImageSize size);
  /// Refines disparity() in place. The images have the size of resize().
  void refine(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right);

  // The images belong to the refinement, but others may write to them, too: they are many bytes. Rows are padded as
  // those of Image.
  /// px; NaN: unknown.
  ImageView<float> disparity() { return padded(disparity_[0]); }
  /// Of no use between two calls of refine().
  ImageView<float> spare() { return padded(disparity_[1]); }
  /// Of the last call: information of each fit, of its prior and of the neighbours that agree with it, px⁻².
  ImageView<float> information() { return padded(information_[0]); }
  /// Of the last call: the relief of ReliefRow, px².
  ImageView<float> relief() { return padded(information_[1]); }
  /// Of the last call: 1 where the window of the fit has texture, else 0.
  ImageView<std::uint8_t> textured() { return textured_.view().crop(0, 0, size_.width, size_.height); }
  /// Of the last call: variances of the gradients, sampled.
  GradientVariances gradients() const { return {mean_gradient_, gradient_difference_}; }
  std::size_t buffer_bytes() const;
  /// An upper bound of buffer_bytes().
  static std::int64_t memory_bytes(ImageSize size, int threads);

 private:
  // Rows of the fit of one thread.
  struct FitBuffers {
    std::vector<std::int16_t> rows;
    std::vector<std::int32_t> columns;
    std::vector<float> gradients;
  };
  struct Smoothing {
    int step;
    float tolerance, least_tolerance, sigmas, growth;
  };

  static constexpr int kPad = 16;  // columns before the first pixel, of which a smoothing reads `step`
  ImageView<float> padded(Image<float>& image) const {
    return {image.data() + kPad, size_.width, size_.height, image.stride()};
  }
  void smooth(const Smoothing& by);
  void measure_relief();
  void fit(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right);
  void sample_gradients(int row, const std::array<const std::int32_t*, kFitSums>& columns, std::vector<float>& buffer);
  void fit_rows(int from, int to, FitBuffers& buffers);

  RefinementKernels kernels_;
  ThreadPool workers_;
  ImageSize size_;
  Image<std::uint8_t> left_, right_;                     // with replicated columns on both sides
  std::array<Image<float>, 2> disparity_, information_;  // current and next (in the end: relief)
  Image<std::uint8_t> textured_;
  Image<float> mean_gradient_, gradient_difference_;  // variances
  Image<float> no_disparity_, no_information_;        // a row outside of the image
  std::vector<FitBuffers> buffers_;
};

}  // namespace spartan::internal::matching
