// Kernels of semi-global matching in two search intervals, one version per SIMD instruction set.
//
// A pixel has 32 levels: levels 0 … 15 are the disparities first, first + 1 …, levels 16 … 31 are second, second + 1 ….
// Its costs are two blocks of 16 bytes, one per interval. All vectors hold whole blocks, so that the neighbouring
// disparity is a shift within the block, on every instruction set. Levels of different intervals are not neighbours.
//
// Rows must be readable and writable for one vector (64 bytes) behind their last pixel.
//
// A census signature has 32 bits in 4 byte planes: the pixels of the 9×7 window whose row and column sum to an odd
// number, as on a checkerboard, compared with the centre (Zabih & Woodfill, ECCV 1994). Right planes are mirrored, so
// that increasing disparity runs forward in memory.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace spartan::internal::matching {

inline constexpr int kInterval = 16;           ///< Disparities of an interval.
inline constexpr int kLevels = 2 * kInterval;  ///< Levels of a pixel.
inline constexpr int kPlanes = 4;              ///< Bytes of a census signature.
inline constexpr int kCensusBits = 8 * kPlanes;
inline constexpr std::uint8_t kNever = 255;  ///< Cost of a level outside of the search range.

inline constexpr int kP2Bin = 4;  ///< Gray levels of a bin of the table of P2.

/// A pixel that the signature compares with the centre.
struct Neighbour {
  int row, column;  ///< 0 … 6 (3: the centre's), −4 … 4
};
/// The pixels of all bits: those at an odd sum of row and column distances from the centre.
inline constexpr auto kCensusNeighbours = [] {
  std::array<Neighbour, kCensusBits> neighbours{};
  std::size_t bit = 0;
  for (int row = 0; row < 7; ++row) {
    for (int column = -4; column <= 4; ++column) {
      if (((row - 3 + column) & 1) != 0) neighbours[bit++] = {row, column};
    }
  }
  return neighbours;
}();

/// Census transform of one row: `rows` are the image rows y−3 … y+3, each readable from −4 to width + 3.
struct CensusRow {
  const std::uint8_t* rows[7];
  std::uint8_t* planes[kPlanes];
  int width;
};

/// Matching costs of one row, kLevels bytes a pixel. right[p] points at the mirrored pixel of x = 0 and disparity 0:
/// pixel x and disparity d read right[p][d − x]. Disparities d > x, which lie left of the right image, cost
/// `out_of_view`.
struct CostRow {
  const std::uint8_t* left[kPlanes];
  const std::uint8_t* right[kPlanes];
  const std::int16_t* first;   ///< Smallest disparity of the first interval of each pixel.
  const std::int16_t* second;  ///< Of the second interval.
  std::uint8_t* cost;
  int width;
  std::uint8_t out_of_view;
};

/// Penalty P2 of a step between two pixels by their gray-level change, in bins of 4 levels (the last is open).
struct P2Row {
  const std::uint8_t* here;
  const std::uint8_t* before;
  const std::uint8_t* table;  ///< 16 penalties, 16-byte aligned.
  std::uint8_t* p2;
  int width;
};

/// Path costs of the paths that enter a row from the row before, in three directions r:
///   L(d) = C(d) + min(L'(d), L'(d − 1) + p1, L'(d + 1) + p1, min L' + p2)   (Hirschmüller, PAMI 2008, eq. 13)
/// `from` holds L' − min L' of the previous pixel of the path, `to` receives L − min L, kLevels bytes a pixel. The
/// addresses of `from` and `to` may differ by a pixel, which moves diagonal paths by a column. `sum` receives the sum
/// of L over the paths, in addition to what it holds where `add` is set.
struct VerticalRow {
  const std::uint8_t* cost;
  const std::uint8_t* p2[3];
  const std::uint8_t* from[3];
  std::uint8_t* to[3];
  std::uint16_t* sum;
  int width;
  std::uint8_t p1;
  bool add;
};

/// From one pair of intervals to another: new smallest disparity minus old.
struct Transition {
  int first_first = 0, first_second = 0;    ///< New first interval, old first and old second interval.
  int second_first = 0, second_second = 0;  ///< New second interval, old first and old second interval.
  bool none() const { return first_first == 0 && second_second == 0; }
};

/// Path costs of `count` pixels, re-expressed from old intervals to new ones, in place. Levels that the old intervals
/// do not hold become kNever.
struct TransitionRun {
  std::uint8_t* costs;
  int count;
  Transition transition;
};

/// A run of columns with one pair of intervals.
struct ColumnRun {
  int from, to;           ///< Columns from … to − 1.
  Transition from_left;   ///< From the run on the left.
  Transition from_right;  ///< From the run on the right.
};

inline constexpr int kRowsAtOnce = 8;

/// The two paths along the rows, of kRowsAtOnce rows that have the same runs of intervals; their chains of dependent
/// operations overlap. Adds the sum of both paths to `sum`. Rows may be repeated where fewer are left, with `sum` null.
struct HorizontalRows {
  const std::uint8_t* cost[kRowsAtOnce];
  const std::uint8_t* p2_from_left[kRowsAtOnce];
  const std::uint8_t* p2_from_right[kRowsAtOnce];
  std::uint16_t* sum[kRowsAtOnce];
  const ColumnRun* runs;
  int run_count;
  std::uint8_t p1;
};

/// The cheapest level of each pixel, and of each right pixel the left column that reaches it at the lowest cost.
struct SelectRow {
  const std::uint16_t* sum;
  const std::int16_t* first;
  const std::int16_t* second;
  std::uint16_t* winner;  ///< Aggregated cost · 32 + level of each pixel.
  std::uint16_t*
      right_best;  ///< Mirrored: at disparity − x: lowest aggregated cost · 32 + (x mod 32); preset to 0xFFFF.
  int width;
};

/// Where the aggregated cost of a level stands among the kLevels sums of a pixel: even levels first.
constexpr int sum_index(int level) {
  return (level & 1) * kInterval + (level >> 1);
}

struct Kernels {
  void (*census_row)(const CensusRow&);
  void (*cost_row)(const CostRow&);
  void (*p2_row)(const P2Row&);
  void (*vertical_row)(const VerticalRow&);
  void (*apply)(const TransitionRun&);
  void (*horizontal_rows)(const HorizontalRows&);
  void (*select_row)(const SelectRow&);
};

/// The kernels of one instruction set; see simd_target_index().
Kernels kernels_for(std::size_t target_index);

}  // namespace spartan::internal::matching
