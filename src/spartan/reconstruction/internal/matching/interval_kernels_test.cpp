#include "spartan/reconstruction/internal/matching/interval_kernels.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "spartan/numerics/random.h"
#include "spartan/numerics/simd_target.h"
#include "spartan/reconstruction/internal/matching/interval_reference.h"
#include "spartan/reconstruction/internal/matching/row_padding.h"

namespace spartan::internal::matching {
namespace {

std::vector<std::uint8_t> random_bytes(Random& random, std::size_t count, std::uint32_t below) {
  std::vector<std::uint8_t> bytes(count);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random.below(below));
  return bytes;
}

// Every instruction set against the scalar reference, for odd widths.
class IntervalKernels : public ::testing::TestWithParam<SimdTarget> {
 protected:
  Kernels kernels() const { return kernels_for(simd_target_index(GetParam())); }
  static constexpr int kWidths[] = {1, 2, 7, 31, 33, 64, 65, 130};
};

TEST_P(IntervalKernels, CensusEqualsTheReference) {
  Random random(1);
  for (const int width : kWidths) {
    const auto stride = static_cast<std::size_t>(width + 2 * kRowPadding);
    const auto image = random_bytes(random, 7 * stride, 9);
    const auto planes_by = [&](void (*census)(const CensusRow&)) {
      std::vector<std::uint8_t> planes(kPlanes * stride);
      CensusRow row{};
      row.width = width;
      for (std::size_t r = 0; r < 7; ++r) row.rows[r] = image.data() + r * stride + 4;
      for (std::size_t p = 0; p < kPlanes; ++p) row.planes[p] = planes.data() + p * stride;
      census(row);
      std::vector<std::uint8_t> used;
      for (const std::uint8_t* const plane : row.planes) used.insert(used.end(), plane, plane + width);
      return used;
    };
    EXPECT_EQ(planes_by(kernels().census_row), planes_by(reference::census_row)) << width;
  }
}

TEST(CensusNeighbours, FormACheckerboardOfThirtyTwoPixelsWithoutTheCentre) {
  std::vector<int> seen(7 * 9, 0);
  for (const Neighbour& n : kCensusNeighbours) {
    EXPECT_EQ((n.row + n.column + 4) % 2, 0);
    ++seen[static_cast<std::size_t>(n.row * 9 + n.column + 4)];
  }
  for (const int count : seen) EXPECT_LE(count, 1);
  EXPECT_EQ(seen[3 * 9 + 4], 0) << "the centre";
}

TEST_P(IntervalKernels, CostsEqualTheReference) {
  Random random(2);
  for (const int width : kWidths) {
    const auto left = random_bytes(random, static_cast<std::size_t>(kPlanes * (width + kRowPadding)), 256);
    const auto right_width = static_cast<std::size_t>(2 * width + 400);
    const auto right = random_bytes(random, kPlanes * right_width, 256);
    std::vector<std::int16_t> first(static_cast<std::size_t>(width)), second(first);
    for (std::size_t x = 0; x < first.size(); ++x) {
      first[x] = static_cast<std::int16_t>(random.below(40));
      second[x] = static_cast<std::int16_t>(first[x] + kInterval + static_cast<int>(random.below(100)));
    }
    const auto costs_by = [&](void (*costs)(const CostRow&)) {
      std::vector<std::uint8_t> cost(static_cast<std::size_t>(width) * kLevels + kRowPadding);
      CostRow row{};
      for (int p = 0; p < kPlanes; ++p) {
        row.left[p] = left.data() + p * (width + kRowPadding);
        row.right[p] = right.data() + static_cast<std::size_t>(p) * right_width + width;
      }
      row.first = first.data();
      row.second = second.data();
      row.cost = cost.data();
      row.width = width;
      row.out_of_view = 11;
      costs(row);
      cost.resize(static_cast<std::size_t>(width) * kLevels);
      return cost;
    };
    EXPECT_EQ(costs_by(kernels().cost_row), costs_by(reference::cost_row)) << width;
  }
}

TEST_P(IntervalKernels, PenaltiesEqualTheReference) {
  Random random(3);
  alignas(16) std::uint8_t table[16];
  for (int i = 0; i < 16; ++i) table[i] = static_cast<std::uint8_t>(90 - 4 * i);
  for (const int width : kWidths) {
    const auto size = static_cast<std::size_t>(width + kRowPadding);
    const auto here = random_bytes(random, size, 256), before = random_bytes(random, size, 256);
    std::vector<std::uint8_t> found(size), expected(size);
    kernels().p2_row({here.data(), before.data(), table, found.data(), width});
    reference::p2_row({here.data(), before.data(), table, expected.data(), width});
    found.resize(static_cast<std::size_t>(width));
    expected.resize(static_cast<std::size_t>(width));
    EXPECT_EQ(found, expected) << width;
  }
}

// Path costs L' − min L' of random paths.
std::vector<std::uint8_t> random_paths(Random& random, int width) {
  auto paths = random_bytes(random, static_cast<std::size_t>(width + 4) * kLevels, 130);
  for (std::size_t x = 0; x + kLevels <= paths.size(); x += kLevels) paths[x + random.below(kLevels)] = 0;
  return paths;
}

TEST_P(IntervalKernels, VerticalPathsEqualTheReference) {
  Random random(4);
  for (const int width : kWidths) {
    for (const bool add : {false, true}) {
      const auto levels = static_cast<std::size_t>(width) * kLevels;
      const auto cost = random_bytes(random, levels + kRowPadding, 33);
      std::vector<std::uint8_t> from[3], p2[3];
      for (int path = 0; path < 3; ++path) {
        from[path] = random_paths(random, width);
        p2[path] = random_bytes(random, static_cast<std::size_t>(width + kRowPadding), 96);
      }
      const auto result_by = [&](void (*vertical)(const VerticalRow&)) {
        std::vector<std::uint16_t> sum(levels + kRowPadding, 700), all;
        std::vector<std::uint8_t> to[3];
        VerticalRow row{};
        row.cost = cost.data();
        row.sum = sum.data();
        row.width = width;
        row.p1 = 18;
        row.add = add;
        for (int path = 0; path < 3; ++path) {
          to[path].resize(levels + kRowPadding);
          row.p2[path] = p2[path].data();
          row.from[path] = from[path].data();
          row.to[path] = to[path].data();
        }
        vertical(row);
        all.assign(sum.begin(), sum.begin() + static_cast<std::ptrdiff_t>(levels));
        for (const auto& path : to)
          all.insert(all.end(), path.begin(), path.begin() + static_cast<std::ptrdiff_t>(levels));
        return all;
      };
      EXPECT_EQ(result_by(kernels().vertical_row), result_by(reference::vertical_row)) << width;
    }
  }
}

Transition random_transition(Random& random) {
  const auto shift = [&] { return static_cast<int>(random.below(45)) - 22; };
  return {shift(), shift(), shift(), shift()};
}

TEST_P(IntervalKernels, TransitionsEqualTheReference) {
  Random random(5);
  for (int trial = 0; trial < 200; ++trial) {
    const int count = 1 + static_cast<int>(random.below(9));
    auto found = random_paths(random, count), expected = found;
    const Transition transition = random_transition(random);
    kernels().apply({found.data(), count, transition});
    reference::apply({expected.data(), count, transition});
    ASSERT_EQ(found, expected);
  }
}

TEST_P(IntervalKernels, HorizontalPathsEqualTheReference) {
  Random random(6);
  for (const int width : kWidths) {
    const auto levels = static_cast<std::size_t>(width) * kLevels;
    std::vector<ColumnRun> runs;
    for (int x = 0; x < width;) {
      const int to = std::min(width, x + 8 * (1 + static_cast<int>(random.below(3))));
      runs.push_back({x, to, random_transition(random), random_transition(random)});
      x = to;
    }
    std::vector<std::uint8_t> costs[kRowsAtOnce], p2[2 * kRowsAtOnce];
    for (auto& cost : costs) cost = random_bytes(random, levels + kRowPadding, 33);
    for (auto& penalties : p2) penalties = random_bytes(random, static_cast<std::size_t>(width + kRowPadding), 96);
    const auto sums_by = [&](void (*horizontal)(const HorizontalRows&)) {
      std::vector<std::uint16_t> sums[kRowsAtOnce], all;
      HorizontalRows rows{};
      for (int r = 0; r < kRowsAtOnce; ++r) {
        sums[r].assign(levels + kRowPadding, 300);
        rows.cost[r] = costs[r].data();
        rows.p2_from_left[r] = p2[2 * r].data();
        rows.p2_from_right[r] = p2[2 * r + 1].data();
        rows.sum[r] = sums[r].data();
      }
      rows.runs = runs.data();
      rows.run_count = static_cast<int>(runs.size());
      rows.p1 = 18;
      horizontal(rows);
      for (const auto& sum : sums)
        all.insert(all.end(), sum.begin(), sum.begin() + static_cast<std::ptrdiff_t>(levels));
      return all;
    };
    EXPECT_EQ(sums_by(kernels().horizontal_rows), sums_by(reference::horizontal_rows)) << width;
  }
}

TEST_P(IntervalKernels, SelectionEqualsTheReference) {
  Random random(7);
  for (const int width : kWidths) {
    const auto size = static_cast<std::size_t>(width);
    std::vector<std::uint16_t> sum(size * kLevels);
    for (auto& value : sum) value = static_cast<std::uint16_t>(random.below(width % 2 == 0 ? 200 : 2040));
    std::vector<std::int16_t> first(size), second(size);
    for (std::size_t x = 0; x < size; ++x) {
      first[x] = static_cast<std::int16_t>(random.below(40));
      second[x] = static_cast<std::int16_t>(first[x] + kInterval + static_cast<int>(random.below(60)));
    }
    const auto result_by = [&](void (*select)(const SelectRow&)) {
      std::vector<std::uint16_t> winner(size), right(size + 200, 0xFFFF);
      select({sum.data(), first.data(), second.data(), winner.data(), right.data() + size, width});
      winner.insert(winner.end(), right.begin(), right.end());
      return winner;
    };
    EXPECT_EQ(result_by(kernels().select_row), result_by(reference::select_row)) << width;
  }
}

INSTANTIATE_TEST_SUITE_P(Simd, IntervalKernels, ::testing::ValuesIn(available_simd_targets()),
                         [](const auto& test) { return std::string(name_of(test.param)); });

}  // namespace
}  // namespace spartan::internal::matching
