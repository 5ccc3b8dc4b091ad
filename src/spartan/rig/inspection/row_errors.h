// How far the rows of two eyes are apart.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/rig/inspection/pair_refinement.h"

namespace spartan {

/// Row differences (left − right) of matches, pixels.
struct RowErrors {
  double mean_px = 0, p95_px = 0;  ///< of their absolute values
  double median_px = 0;            ///< signed
};

/// What stereo needs: 0.5 px in the mean, 1.5 px for 95 %.
inline constexpr double kGoodRowsMean_px = 0.5, kGoodRowsP95_px = 1.5;
inline bool are_good(const RowErrors& rows) {
  return rows.mean_px <= kGoodRowsMean_px && rows.p95_px <= kGoodRowsP95_px;
}

/// A part of the left picture.
struct RowErrorCell {
  Eigen::Vector2d centre_px;
  int matches = 0;
  double median_px = 0;  ///< signed row difference of the pair as given, in the rectified view
};

/// What is no number (no line of sight) does not count; NaN without any that is.
RowErrors row_errors(std::vector<double> signed_px);

/// The picture in 8 × 6 parts; those with at least 3 matches, row by row. Empty where the size is not known.
std::vector<RowErrorCell> map_row_errors(const std::vector<PixelMatch>& matches, const std::vector<double>& signed_px,
                                         ImageSize picture);
inline constexpr int kRowErrorCells = 8 * 6;

}  // namespace spartan
