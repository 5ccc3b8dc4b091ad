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
#include "spartan/reconstruction/internal/matching/row_padding.h"
#include "spartan/reconstruction/internal/matching/search_intervals.h"

namespace spartan::internal::matching {

inline constexpr int kStripMargin = 24;
inline constexpr int kDirections = 3;  ///< Paths of a sweep from the row before: from x − 1, x, x + 1.

/// Rows of a strip, a multiple of the tile: about 128, fewer where a row has so many costs that the strip would exceed
/// about 16 million. The number of strips is even where the image has enough rows, so that two threads have as much to
/// do.
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

/// The costs and sums of a strip.
struct StripCosts {
  StripBuffers& buffers;
  StripRows rows;
  std::ptrdiff_t row_costs;  // of one row

  void resize() {
    const auto costs_of = [&](int count) { return static_cast<std::size_t>(count * row_costs) + kRowPadding; };
    at_least(costs_of(rows.last - rows.first), buffers.costs);
    at_least(costs_of(rows.to - rows.from), buffers.sums);
    at_least(costs_of(1), buffers.unused_sums);
  }
  std::uint8_t* cost(int y) const { return buffers.costs.data() + (y - rows.first) * row_costs; }
  // Rows of the margin have no sums that anything needs.
  std::uint16_t* sum(int y) const {
    return y < rows.from || y >= rows.to ? buffers.unused_sums.data()
                                         : buffers.sums.data() + (y - rows.from) * row_costs;
  }
};

/// Matches a strip: its costs, the downward paths and the paths along the rows, then the upward paths and the winners,
/// as soon as all eight paths of a row are known. `matching` has the steps of one matcher:
///   compute_costs(y), begin_sweep(), sweep_row(y, row before it on the paths or y itself where they begin, whether to
///   add to the sums), along_rows(from, to) of at most kRowsAtOnce rows, select(y).
template <class Matching>
void match_strip(const StripRows& rows, Matching& matching) {
  for (int y = rows.first; y < rows.last; ++y) matching.compute_costs(y);
  matching.begin_sweep();
  for (int y = rows.first; y < rows.to; ++y) {
    matching.sweep_row(y, std::max(y - 1, rows.first), false);
    if (y >= rows.from && ((y + 1) % kRowsAtOnce == 0 || y + 1 == rows.to))
      matching.along_rows(y / kRowsAtOnce * kRowsAtOnce, y + 1);
  }
  matching.begin_sweep();
  for (int y = rows.last - 1; y >= rows.from; --y) {
    matching.sweep_row(y, std::min(y + 1, rows.last - 1), true);
    if (y < rows.to) matching.select(y);
  }
}

/// Calls match(rows, buffers) for each strip of an image; each thread keeps its buffers and takes the next strip that
/// is left.
void for_each_strip(int height, int rows_per_strip, const ThreadPool& workers, std::vector<StripBuffers>& buffers,
                    const std::function<void(const StripRows&, StripBuffers&)>& match);

}  // namespace spartan::internal::matching
