// Standard deviation and outlier probability of refined disparities; see docs/math/stereo.md.
#pragma once

#include <cstdint>

#include "spartan/core/image.h"
#include "spartan/core/threads.h"
#include "spartan/reconstruction/internal/matching/refinement_kernels.h"

namespace spartan::internal::matching {

/// Logistic regression of |error| > 1 px, and standard deviation of the other errors. Fitted to real pairs (Middlebury,
/// ETH3D) and simulated ones, which count equally (sigma to the simulated ones). The information contains how well the
/// neighbours agree, so sigma falls faster than with its root; errors inside a pixel have a largest sigma, that of a
/// uniform distribution, 1/√3. Unrelated noise has patches of consistent disparities, too, but hardly pixels with an
/// outlier probability as small as that of reliable ones.
inline constexpr ReliabilityModel kReliability{2.502F, 0.474F, -0.525F, 0.396F, 7.0F, 37.5F, 1.97F, 0.017F, 0.523F};

/// What the assessment reads and what it writes. Rows are padded to 64 bytes, as those of Image.
struct Evidence {
  ImageView<const float> information;  ///< px⁻²
  ImageView<const float> relief;       ///< px²
  ImageView<const std::uint8_t> right_distance;
  int most_percent;  ///< Disparities with a larger outlier probability are discarded.
};
struct Assessed {
  ImageView<float> disparity;
  ImageView<float> sigma;  ///< px; may be the image of the information.
  ImageView<std::uint8_t> outlier_percent;
  ImageView<std::uint8_t> reliable;  ///< 1 or 0; in: whether the window of the fit has texture.
};

/// Sets sigma and outlier probability of all pixels, and discards the disparities that are too unlikely.
void assess(const Evidence& evidence, const RefinementKernels& kernels, const ThreadPool& workers, const Assessed& to);

/// Sigma NaN and outlier probability 100 % where the disparity is unknown.
void clear_unknown(const ThreadPool& workers, const Assessed& to);

}  // namespace spartan::internal::matching
