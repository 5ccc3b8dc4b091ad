// Strips of rows that are matched independently of each other. Their number depends on the height and the bytes of a
// row alone, so that results are the same for any number of threads. A strip begins its downward paths kStripMargin
// rows above itself and its upward paths as many rows below, where their start has little influence left.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/threads.h"
#include "spartan/reconstruction/internal/matching/interval_kernels.h"
#include "spartan/reconstruction/internal/matching/search_intervals.h"

namespace spartan::internal::matching {

inline constexpr int kStripMargin = 24;
inline constexpr int kDirections = 3;  ///< Paths of a sweep from the row before: from x − 1, x, x + 1.

/// Rows of a strip, a multiple of the tile: about 128, fewer where a row has so many costs that the strip would exceed
/// about 16 million, and at least two strips where the image has enough rows for it.
int strip_rows(int height, std::int64_t costs_per_row);

/// Rows from … to − 1 of a strip, and first … last − 1 with its margins.
struct StripRows {
  int from = 0, to = 0, first = 0, last = 0;
};

/// Buffers of one strip, kept from call to call; they only grow. Matchers that run one after the other share them.
struct StripBuffers {
  Image<std::uint8_t> costs;  // of one row, as are the sums
  Image<std::uint16_t> sums;
  std::vector<std::uint8_t> paths, minima, p2, slots;
  std::vector<std::uint16_t> unused_sums, winners, right_best;
  std::vector<std::int16_t> starts;
  std::vector<ColumnRun> runs;
  std::size_t bytes() const;
};

template <class T>
void at_least(std::size_t size, std::vector<T>& buffer) {
  if (buffer.size() < size) buffer.resize(size);
}
template <class T>
void at_least(std::size_t size, Image<T>& buffer) {
  if (buffer.width() < static_cast<int>(size)) buffer = Image<T>(static_cast<int>(size), 1);
}

/// Calls match(rows, buffers) for each strip of an image; each thread keeps its buffers and takes the next strip that
/// is left.
void for_each_strip(int height, int rows_per_strip, const ThreadPool& workers, std::vector<StripBuffers>& buffers,
                    const std::function<void(const StripRows&, StripBuffers&)>& match);

}  // namespace spartan::internal::matching
