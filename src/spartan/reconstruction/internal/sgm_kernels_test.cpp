#include "spartan/reconstruction/internal/sgm_kernels.h"

#include <gtest/gtest.h>

#include <vector>

#include "spartan/numerics/random.h"
#include "spartan/numerics/simd_target.h"
#include "spartan/reconstruction/internal/sgm_reference.h"

namespace spartan::internal::sgm {
namespace {

std::vector<std::uint8_t> random_bytes(std::uint64_t seed, std::size_t count, std::uint32_t below) {
  Random random(seed);
  std::vector<std::uint8_t> bytes(count);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random.below(below));
  return bytes;
}

// Every instruction set against the scalar reference, for odd widths and both vector widths of the disparities.
class KernelsOnEveryTarget : public ::testing::TestWithParam<SimdTarget> {
 protected:
  Kernels kernels() const { return kernels_for(simd_target_index(GetParam())); }
};

TEST_P(KernelsOnEveryTarget, CensusEqualsTheReference) {
  for (const int width : {1, 7, 15, 16, 17, 63, 64, 65, 200}) {
    const auto stride = static_cast<std::size_t>(width + 80);
    const std::vector<std::uint8_t> image = random_bytes(static_cast<std::uint64_t>(width), 7 * stride, 9);
    std::vector<std::uint8_t> found(kPlanes * stride), expected(kPlanes * stride);
    const auto row_into = [&](std::vector<std::uint8_t>& planes) {
      CensusRow row{};
      row.width = width;
      for (std::size_t r = 0; r < 7; ++r) row.rows[r] = image.data() + r * stride + 4;
      for (std::size_t p = 0; p < kPlanes; ++p) row.planes[p] = planes.data() + p * stride;
      return row;
    };
    kernels().census_row(row_into(found));
    reference::census_row(row_into(expected));
    for (std::size_t p = 0; p < kPlanes; ++p) {
      for (std::size_t x = 0; x < static_cast<std::size_t>(width); ++x) {
        ASSERT_EQ(found[p * stride + x], expected[p * stride + x]) << width << " px, plane " << p << ", x " << x;
      }
    }
  }
}

TEST_P(KernelsOnEveryTarget, CostsEqualTheReference) {
  for (const int padded : {32, 64, 96, 128}) {
    const int width = 37;
    const auto right_width = static_cast<std::size_t>(width + padded + 64);
    const auto left = random_bytes(1, static_cast<std::size_t>(kPlanes * width), 256);
    const auto right = random_bytes(2, kPlanes * right_width, 256);
    std::vector<std::uint8_t> found(static_cast<std::size_t>(width * padded)), expected = found;
    CostRow row{};
    row.width = width;
    row.padded = padded;
    for (int p = 0; p < kPlanes; ++p) {
      row.left[p] = left.data() + p * width;
      row.right[p] = right.data() + static_cast<std::size_t>(p) * right_width + width - 1;
    }
    row.cost = found.data();
    kernels().cost_row(row);
    row.cost = expected.data();
    reference::cost_row(row);
    ASSERT_EQ(found, expected) << padded << " disparities";
  }
}

TEST_P(KernelsOnEveryTarget, PathsEqualTheReference) {
  for (const int padded : {32, 64, 96, 128}) {
    for (const bool adds : {false, true}) {
      const int stride = padded + 2 * kGuard;
      alignas(64) static std::uint8_t found_slots[kPaths * (128 + 2 * kGuard)],
          expected_slots[kPaths * (128 + 2 * kGuard)];
      const auto start =
          random_bytes(static_cast<std::uint64_t>(padded), static_cast<std::size_t>(kPaths * stride), 240);
      for (int i = 0; i < kPaths * stride; ++i) {
        const int k = i % stride - kGuard;
        found_slots[i] = expected_slots[i] = k < 0 || k >= padded ? kNever : start[static_cast<std::size_t>(i)];
      }
      const auto cost = random_bytes(5, static_cast<std::size_t>(padded), 63);
      const std::vector<std::uint16_t> before(static_cast<std::size_t>(padded), 700);
      std::vector<std::uint16_t> found(before.size()), expected(before.size());
      const auto paths_over = [&](std::uint8_t* slots, std::vector<std::uint16_t>& sums) {
        PixelPaths paths{};
        paths.cost = cost.data();
        paths.p1 = 36;
        paths.padded = padded;
        paths.add = adds ? before.data() : nullptr;
        paths.sum = sums.data();
        for (int r = 0; r < kPaths; ++r) {
          paths.from[r] = paths.to[r] = slots + r * stride + kGuard;
          paths.p2[r] = static_cast<std::uint8_t>(40 + 45 * r);
          paths.from_min[r] = 255;
          for (int k = 0; k < padded; ++k) paths.from_min[r] = std::min(paths.from_min[r], paths.from[r][k]);
        }
        return paths;
      };
      const PathMinima a = kernels().pixel_paths(paths_over(found_slots, found));
      const PathMinima b = reference::pixel_paths(paths_over(expected_slots, expected));
      ASSERT_EQ(found, expected);
      for (int r = 0; r < kPaths; ++r) ASSERT_EQ(a.of[r], b.of[r]);
      for (int i = 0; i < kPaths * stride; ++i) ASSERT_EQ(found_slots[i], expected_slots[i]) << "slot byte " << i;
    }
  }
}

TEST_P(KernelsOnEveryTarget, WinnersEqualTheReference) {
  Random random(9);
  for (int trial = 0; trial < 300; ++trial) {
    const int padded = 32 * (1 + static_cast<int>(random.below(4))),
              count = padded - static_cast<int>(random.below(31));
    std::vector<std::uint16_t> sums(static_cast<std::size_t>(padded), 2040);
    for (int k = 0; k < count; ++k) sums[static_cast<std::size_t>(k)] = static_cast<std::uint16_t>(random.below(40));
    ASSERT_EQ(kernels().find_winner(sums.data(), padded), reference::find_winner(sums.data(), padded));
  }
}

INSTANTIATE_TEST_SUITE_P(Simd, KernelsOnEveryTarget, ::testing::ValuesIn(available_simd_targets()),
                         [](const auto& test) { return std::string(name_of(test.param)); });

}  // namespace
}  // namespace spartan::internal::sgm
