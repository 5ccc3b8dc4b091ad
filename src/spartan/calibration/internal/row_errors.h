// Statistics of the row errors (vertical disparities) of a stereo pair.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "spartan/calibration/internal/pair_refinement.h"
#include "spartan/calibration/pair_check.h"
#include "spartan/core/image.h"

namespace spartan::internal {

/// What stereo matching needs: a mean of at most 0.5 px, and 95 % of the matches within 1.5 px.
inline constexpr double kGoodRowsMean_px = 0.5, kGoodRowsP95_px = 1.5;
inline bool are_good(const RowErrors& rows) {
  return rows.mean_px <= kGoodRowsMean_px && rows.p95_px <= kGoodRowsP95_px;
}

/// Statistics of the finite values (others are matches that cannot be unprojected); NaN where there is none.
RowErrors row_errors(std::vector<double> signed_px);

/// Row errors in a grid of 8 × 6 cells over the left image: the cells with at least 3 matches, row by row. Empty where
/// the image size is not known. `signed_px`: one value per match.
std::vector<RowErrorCell> map_row_errors(const std::vector<PixelMatch>& matches, const std::vector<double>& signed_px,
                                         ImageSize image_size);
inline constexpr int kRowErrorCells = 8 * 6;

}  // namespace spartan::internal
