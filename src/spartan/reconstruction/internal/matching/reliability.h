// Standard deviation and outlier probability of refined disparities. The constants were fitted to the errors of
// simulated and real pairs with truth; see docs/math/stereo.md.
#pragma once

#include <cstdint>

#include "spartan/core/image.h"
#include "spartan/core/threads.h"

namespace spartan::internal::matching {

/// Probability that a disparity is off by more than one pixel, percent, from the information of its fit (px⁻²) and the
/// distance between the left pixel and the one that its match prefers (px).
std::uint8_t outlier_percent(float information, int right_distance);

/// Standard deviation of a disparity that is no outlier, px.
float disparity_sigma(float information);

/// What the assessment reads and what it writes.
struct Evidence {
  ImageView<const float> information;
  ImageView<const std::uint8_t> right_distance;
  int most_percent;  ///< Disparities with a larger outlier probability are discarded.
};
struct Assessed {
  ImageView<float> disparity;
  ImageView<float> sigma;  ///< px
  ImageView<std::uint8_t> outlier_percent;
};

/// Sets sigma and outlier probability of all pixels, and discards the disparities that are too unlikely.
void assess(const Evidence& evidence, const ThreadPool& workers, const Assessed& to);

/// Sigma NaN and outlier probability 100 % where the disparity is unknown.
void clear_unknown(const ThreadPool& workers, const Assessed& to);

}  // namespace spartan::internal::matching
