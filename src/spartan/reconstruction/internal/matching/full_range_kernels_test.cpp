#include "spartan/reconstruction/internal/matching/full_range_kernels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "spartan/numerics/random.h"
#include "spartan/numerics/simd_target.h"
#include "spartan/reconstruction/internal/matching/full_range_reference.h"
#include "spartan/reconstruction/internal/matching/row_padding.h"

namespace spartan::internal::matching {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes bytes_below(Random& random, std::size_t count, std::uint32_t below) {
  Bytes bytes(count);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random.below(below));
  return bytes;
}

// Every instruction set against the scalar reference, for odd widths and multiples of half and of whole vectors.
class FullRangeKernelsOf : public ::testing::TestWithParam<SimdTarget> {
 protected:
  FullRangeKernels kernels() const { return full_range_kernels_for(simd_target_index(GetParam())); }
  static constexpr int kLevelCounts[] = {32, 64, 96, 128, 160};
  static constexpr int kWidth = 21;

  // Costs of a row whose last level is behind the range.
  static Bytes costs(Random& random, int levels) {
    Bytes cost = bytes_below(random, static_cast<std::size_t>(kWidth * levels) + kRowPadding, 33);
    for (int x = 0; x < kWidth; ++x) cost[static_cast<std::size_t>((x + 1) * levels) - 1] = kNever;
    return cost;
  }
  static Bytes penalties(Random& random) {
    return bytes_below(random, static_cast<std::size_t>(kWidth + kRowPadding), 96);
  }
};

TEST_P(FullRangeKernelsOf, CostsEqualTheReference) {
  Random random(1);
  for (const int levels : kLevelCounts) {
    const auto right_width = static_cast<std::size_t>(kWidth + levels + 2 * kRowPadding);
    const Bytes left = bytes_below(random, kPlanes * kWidth, 256),
                right = bytes_below(random, kPlanes * right_width, 256);
    const auto costs_by = [&](void (*kernel)(const FullCostRow&)) {
      Bytes cost(static_cast<std::size_t>(kWidth * levels));
      FullCostRow row{};
      for (int p = 0; p < kPlanes; ++p) {
        row.left[p] = left.data() + p * kWidth;
        row.right[p] = right.data() + static_cast<std::size_t>(p) * right_width + kWidth - 1;
      }
      row.cost = cost.data();
      row.width = kWidth;
      row.levels = levels;
      kernel(row);
      return cost;
    };
    EXPECT_EQ(costs_by(kernels().cost_row), costs_by(reference::cost_row)) << levels;
  }
}

TEST_P(FullRangeKernelsOf, VerticalPathsEqualTheReference) {
  Random random(2);
  for (const int levels : kLevelCounts) {
    const auto row_levels = static_cast<std::size_t>(kWidth * levels);
    const Bytes cost = costs(random, levels);
    Bytes from[3], from_min[3], p2[3];
    for (int i = 0; i < 3; ++i) {
      from[i] = bytes_below(random, row_levels + 2 * kRowPadding, 200);
      p2[i] = penalties(random);
      for (int x = 0; x < kWidth; ++x) {
        const auto first = from[i].begin() + kRowPadding + x * levels;
        from_min[i].push_back(*std::min_element(first, first + levels));
      }
    }
    for (const bool add : {false, true}) {
      const auto result_by = [&](void (*kernel)(const FullVerticalRow&)) {
        std::vector<std::uint16_t> sum(row_levels, 500);
        Bytes to[3], to_min[3];
        FullVerticalRow row{};
        row.cost = cost.data();
        row.sum = sum.data();
        row.width = kWidth;
        row.levels = levels;
        row.p1 = 18;
        row.add = add;
        for (int i = 0; i < 3; ++i) {
          to[i].resize(row_levels);
          to_min[i].resize(kWidth);
          row.p2[i] = p2[i].data();
          row.from[i] = from[i].data() + kRowPadding;
          row.from_min[i] = from_min[i].data();
          row.to[i] = to[i].data();
          row.to_min[i] = to_min[i].data();
        }
        kernel(row);
        for (int i = 0; i < 3; ++i) {
          sum.insert(sum.end(), to[i].begin(), to[i].end());
          sum.insert(sum.end(), to_min[i].begin(), to_min[i].end());
        }
        return sum;
      };
      EXPECT_EQ(result_by(kernels().vertical_row), result_by(reference::vertical_row)) << levels;
    }
  }
}

TEST_P(FullRangeKernelsOf, HorizontalPathsEqualTheReference) {
  Random random(3);
  for (const int levels : kLevelCounts) {
    Bytes cost[kRowsAtOnce], p2[2 * kRowsAtOnce];
    for (Bytes& row : cost) row = costs(random, levels);
    for (Bytes& row : p2) row = penalties(random);
    const auto sums_by = [&](void (*kernel)(const FullHorizontalRows&)) {
      std::vector<std::uint16_t> sums[kRowsAtOnce], all;
      Bytes slots(2 * kRowsAtOnce * slot_bytes(levels));
      FullHorizontalRows rows{};
      for (int i = 0; i < kRowsAtOnce; ++i) {
        sums[i].assign(static_cast<std::size_t>(kWidth * levels), 300);
        rows.cost[i] = cost[i].data();
        rows.p2_from_left[i] = p2[2 * i].data();
        rows.p2_from_right[i] = p2[2 * i + 1].data();
        rows.sum[i] = sums[i].data();
      }
      rows.slots = slots.data();
      rows.width = kWidth;
      rows.levels = levels;
      rows.p1 = 18;
      kernel(rows);
      for (const auto& sum : sums) all.insert(all.end(), sum.begin(), sum.end());
      return all;
    };
    EXPECT_EQ(sums_by(kernels().horizontal_rows), sums_by(reference::horizontal_rows)) << levels;
  }
}

TEST_P(FullRangeKernelsOf, WinnersEqualTheReference) {
  Random random(4);
  for (int trial = 0; trial < 300; ++trial) {
    std::vector<std::uint16_t> sums(static_cast<std::size_t>(32 * (1 + static_cast<int>(random.below(6)))));
    for (auto& sum : sums) sum = static_cast<std::uint16_t>(random.below(40));
    const int levels = static_cast<int>(sums.size());
    ASSERT_EQ(kernels().find_winner(sums.data(), levels), reference::find_winner(sums.data(), levels));
  }
}

INSTANTIATE_TEST_SUITE_P(Simd, FullRangeKernelsOf, ::testing::ValuesIn(available_simd_targets()),
                         [](const auto& test) { return std::string(name_of(test.param)); });

}  // namespace
}  // namespace spartan::internal::matching
