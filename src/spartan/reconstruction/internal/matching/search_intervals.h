// Two search intervals per tile of an image: where disparities are searched, from the disparities of half the
// resolution.
#pragma once

#include "spartan/core/image.h"
#include "spartan/core/threads.h"
#include "spartan/reconstruction/disparity_computer.h"
#include "spartan/reconstruction/internal/matching/interval_kernels.h"

namespace spartan::internal::matching {

inline constexpr int kTile = 8;    ///< Side of a tile, pixels.
inline constexpr int kMargin = 4;  ///< Disparities of an interval on both sides of those that it was chosen for.

/// The smallest disparities of the two intervals of a tile. They do not overlap, and first < second.
struct TileIntervals {
  std::int16_t first = 0, second = kInterval;
  bool operator==(const TileIntervals&) const = default;
};

Transition transition(const TileIntervals& from, const TileIntervals& to);

/// Intervals of all tiles of an image of the given size. `coarse` holds the disparities of half the resolution, in its
/// own pixels; NaN: unknown. For each tile, the disparities of the tile and its eight neighbours are counted: the first
/// choice is the interval that holds most of them with kMargin to spare on both sides, the second choice the one that
/// holds most of the others. A tile without disparities takes the intervals of the tile on its left.
Image<TileIntervals> choose_intervals(ImageView<const float> coarse, ImageSize size, DisparityRange range,
                                      const ThreadPool& workers);

}  // namespace spartan::internal::matching
