// Dense stereo matching: from a rectified image pair to a disparity image.
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "spartan/core/image.h"
#include "spartan/core/options.h"
#include "spartan/core/result.h"
#include "spartan/core/simd.h"
#include "spartan/core/threads.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan {

/// The disparities that are searched: min … max, both included, in whole pixels.
struct DisparityRange {
  int min = 0;
  int max = 63;
  int count() const { return max - min + 1; }
};

/// Wall-clock milliseconds of each step of one call; for reports only, no result depends on them.
struct DisparityTimes {
  double coarse = 0;  ///< matching at a quarter and at half of the resolution
  double match = 0;   ///< matching at full resolution
  double filter = 0;  ///< masks, median, speckle filter
  double refine = 0;  ///< sub-pixel refinement, sigma and outlier probability
  double total = 0;
};

/// A disparity image of the rectified left camera: x_left − x_right in pixels, NaN where unknown. The views borrow the
/// computer's buffers and are valid until its next call.
struct DisparityImage {
  ImageView<const float> disparity;
  ImageView<const float> sigma;  ///< Standard deviation, px; NaN where the disparity is unknown or filled.
  ImageView<const std::uint8_t> outlier_percent;  ///< Probability of an error above 1 px, percent; 100 where unknown.
  DisparityTimes times;
  std::size_t buffer_bytes = 0;  ///< Bytes of all buffers held for this image size and search range.
};

struct DisparityOptions;

/// Dense disparities by census matching (Zabih & Woodfill 1994) and semi-global matching (Hirschmüller 2008) from
/// coarse to fine, or by block matching (MatchingMethod), a median filter, a sub-pixel refinement by least squares on
/// the intensities, a check of the outlier probability and a speckle filter. Derivation: docs/math/stereo.md. The
/// result is the same, bit for bit, for any number of threads and on every SIMD instruction set.
class DisparityComputer {
 public:
  /// Code `configuration` where an option is out of bounds.
  static Result<DisparityComputer> create(const DisparityOptions& options, ThreadPool workers);
  DisparityComputer(DisparityComputer&&) noexcept;
  DisparityComputer& operator=(DisparityComputer&&) noexcept;
  ~DisparityComputer();

  /// Both images must be rectified and of one size. Masks (255: valid, 0: excluded) may be empty. Codes as check().
  Result<DisparityImage> compute(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right,
                                 DisparityRange range, ImageView<const std::uint8_t> left_mask = {},
                                 ImageView<const std::uint8_t> right_mask = {});

  /// What compute() needs of its input, without computing: where this is well, compute() does not fail. Code
  /// `frame_rejected` where sizes differ or the range is empty or wider than the image.
  static Status check(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right, DisparityRange range,
                      ImageView<const std::uint8_t> left_mask = {}, ImageView<const std::uint8_t> right_mask = {});

  /// Upper bound of the memory that compute() needs for images of this size and this range, bytes.
  static std::int64_t memory_bytes(ImageSize size, DisparityRange range, int threads);
  /// Code `resources`, with both figures, where memory_bytes() exceeds `most_bytes` (0: no bound). Allocates nothing.
  static Status check_memory(ImageSize size, DisparityRange range, int threads, std::int64_t most_bytes);

 private:
  struct State;
  explicit DisparityComputer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// How disparities are found.
enum class MatchingMethod {
  sgm,    ///< Semi-global matching, coarse to fine.
  block,  ///< Block matching: Gaussian-weighted absolute differences, plane sweep over the range.
};
constexpr auto enum_names(MatchingMethod) {
  return std::array{EnumName{MatchingMethod::sgm, "sgm"}, EnumName{MatchingMethod::block, "block"}};
}

/// With MatchingMethod::sgm, matching costs are Hamming distances of 32-bit census signatures (0 … 32). Semi-global
/// matching penalizes a disparity step of one pixel by P1 and a larger step by P2. P2 falls from p2_flat to p2_edge
/// with the gray-level change ΔI along the path (Hirschmüller 2008):
///   P2(ΔI) = max(p2_edge, p2_flat / (1 + |ΔI| / p2_falloff_levels)).
struct DisparityOptions {
  MatchingMethod method = MatchingMethod::sgm;
  int p1 = 18;                    ///< Penalty of a disparity step of one pixel, census bits.
  int p2_flat = 90;               ///< Penalty of a larger step where the gray level is constant, census bits.
  int p2_edge = 25;               ///< Lower bound of the penalty of a larger step, census bits.
  double p2_falloff_levels = 10;  ///< Gray-level change that halves P2, levels of an 8-bit image.
  int out_of_view_cost = 11;      ///< Matching cost where x − d lies outside of the right image, census bits.
  bool median = true;             ///< Whether to apply a 3×3 median filter.
  int max_outlier_percent = 88;   ///< Largest outlier probability of a disparity that is kept, percent.
  int speckle_size_px = 100;      ///< Minimum size of a connected component, reliable pixels; 0: no speckle filter.
  double speckle_step_px = 2;     ///< Largest disparity difference within a component, pixels.
  bool fill = false;              ///< Whether unknown pixels are filled from their row, with sigma NaN as the mark.
  SimdTarget simd = SimdTarget::automatic;  ///< SIMD instruction set

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("method", method,
            "Matching method: sgm is semi-global matching, block is block matching of Gaussian-weighted absolute "
            "differences, which needs texture everywhere and cameras of equal contrast. The penalties p1 and p2_* and "
            "out_of_view_cost belong to sgm.");
    v.field("p1", p1,
            "Penalty P1 of semi-global matching for a disparity step of one pixel between neighbouring pixels, in bits "
            "of the 32-bit census cost; raising it makes slanted surfaces smoother and flatter.",
            between(0, 30));
    v.field("p2_flat", p2_flat,
            "Penalty P2 for a disparity step of more than one pixel where the gray level is constant, in census bits; "
            "raising it bridges surfaces with little texture, but smooths over small objects.",
            between(1, 95));
    v.field("p2_edge", p2_edge,
            "Lower bound of P2 where the gray level changes, in census bits; raising it allows fewer depth "
            "discontinuities at image edges.",
            between(1, 95));
    v.field("p2_falloff_levels", p2_falloff_levels,
            "Gray-level change between neighbouring pixels that halves P2, in levels of an 8-bit image; raising it "
            "keeps P2 high at weak edges.",
            between(0.1, 1000));
    v.field("out_of_view_cost", out_of_view_cost,
            "Matching cost of disparities that lead outside of the right image, in census bits; raising it makes such "
            "disparities less likely at the left border.",
            between(0, 32));
    v.field("median", median,
            "True applies a 3x3 median filter to the disparities, which removes single outliers and keeps edges; false "
            "keeps outliers and thin structures.");
    v.field("max_outlier_percent", max_outlier_percent,
            "Largest probability of an error above one pixel with which a disparity is kept, in percent. It follows "
            "from the texture, the smoothness of the surroundings and the left-right check. Raising it keeps more "
            "disparities, more of them wrong, and 100 keeps all.",
            between(0, 100));
    v.field(
        "speckle_size_px", speckle_size_px,
        "Minimum size of a connected component of the disparity image, counted in pixels with texture and an outlier "
        "probability of at most 7 %; smaller components are discarded, and 0 disables the speckle filter.",
        at_least(0));
    v.field("speckle_step_px", speckle_step_px,
            "Largest disparity difference between neighbouring pixels of one component of the speckle filter, in "
            "pixels; raising it joins more pixels, so that fewer components are discarded.",
            at_least(0));
    v.field(
        "fill", fill,
        "True gives unknown pixels the farther one of the nearest known disparities in their row. They are marked by "
        "a standard deviation of NaN and an outlier probability of 100 %; maps leave them out.");
    v.field("simd", simd,
            "SIMD instruction set of the matching kernels; avx3 is AVX-512; it affects the speed only, results are the "
            "same bit for bit.");
  }
};

/// The search range of a pair: from 0 to f b / nearest_m, or to a quarter of the image width where `nearest_m` is not
/// given (≤ 0; the search range of the published rover), at most three quarters of the width, rounded up so that the
/// count is a multiple of 16.
DisparityRange disparity_range(const RectifiedStereo& geometry, double nearest_m);

}  // namespace spartan
