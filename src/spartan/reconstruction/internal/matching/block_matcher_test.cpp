#include "spartan/reconstruction/internal/matching/block_matcher.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "spartan/numerics/random.h"
#include "spartan/numerics/simd_target.h"
#include "spartan/reconstruction/internal/subpixel.h"

namespace spartan::internal::matching {
namespace {

using Gray = Image<std::uint8_t>;

struct GrayPair {
  Gray left, right;
};

// A random texture seen under a disparity, with noise.
GrayPair textured_pair(ImageSize size, int disparity, std::uint64_t seed) {
  Random random(seed);
  Gray texture(size.width + 64, size.height);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < texture.width(); ++x) texture(x, y) = static_cast<std::uint8_t>(60 + random.below(120));
  }
  GrayPair pair{Gray(size), Gray(size)};
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      pair.left(x, y) = static_cast<std::uint8_t>(texture(x + 32, y) + random.below(6));
      pair.right(x, y) = static_cast<std::uint8_t>(texture(x + 32 + disparity, y) + random.below(6) + 20);
    }
  }
  return pair;
}

struct Found {
  Image<float> disparity;
  Gray right_distance;
};

Found match(BlockMatcher& matcher, const GrayPair& pair, DisparityRange range) {
  Found found{Image<float>(pair.left.size()), Gray(pair.left.size())};
  matcher.match(pair.left, pair.right, range, {found.disparity, found.right_distance});
  return found;
}

// The same, pixel by pixel over whole images.
class Reference {
 public:
  static Found match(const GrayPair& pair, DisparityRange range) {
    const ImageSize size = pair.left.size();
    const Levels left = without_mean(pair.left), right = without_mean(pair.right);
    std::vector<Levels> costs;
    for (int d = range.min; d <= range.max; ++d) costs.push_back(plane_costs(left, right, size, d));
    Found found{Image<float>(size), Gray(size)};
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) select(costs, range, x, y, size, found);
    }
    return found;
  }

 private:
  // Levels of an image with a margin of 8 pixels to its left and right.
  using Levels = std::vector<std::vector<int>>;
  static constexpr int kMargin = 8;

  static int average(int a, int b, int c) { return ((a + c + 1) / 2 + b + 1) / 2; }
  // Binomial filters along rows, then along columns; columns replicate, as rows do.
  static Levels filtered(Levels rows) {
    for (const int step : {1, 2, 4}) {
      Levels next = rows;
      for (std::size_t y = 0; y < rows.size(); ++y) {
        const int last = static_cast<int>(rows[y].size()) - 1;
        for (int x = step; x + step <= last; ++x) {
          const auto at = [&](int u) { return rows[y][static_cast<std::size_t>(u)]; };
          next[y][static_cast<std::size_t>(x)] = average(at(x - step), at(x), at(x + step));
        }
      }
      rows = next;
    }
    return rows;
  }
  static Levels filtered_down(Levels rows) {
    for (const int step : {1, 2, 4}) {
      Levels next = rows;
      const int last = static_cast<int>(rows.size()) - 1;
      for (int y = 0; y <= last; ++y) {
        const auto& a = rows[static_cast<std::size_t>(std::max(0, y - step))];
        const auto& c = rows[static_cast<std::size_t>(std::min(last, y + step))];
        for (std::size_t x = 0; x < a.size(); ++x)
          next[static_cast<std::size_t>(y)][x] = average(a[x], rows[static_cast<std::size_t>(y)][x], c[x]);
      }
      rows = next;
    }
    return rows;
  }
  static Levels framed(const Gray& image) {
    Levels rows;
    for (int y = 0; y < image.height(); ++y) {
      std::vector<int> row;
      for (int x = -kMargin; x < image.width() + kMargin; ++x)
        row.push_back(image(std::clamp(x, 0, image.width() - 1), y));
      rows.push_back(row);
    }
    return rows;
  }
  static Levels without_mean(const Gray& image) {
    const Levels rows = framed(image), mean = filtered_down(filtered(rows));
    Levels result = rows;
    for (std::size_t y = 0; y < rows.size(); ++y) {
      const int last = static_cast<int>(rows[y].size()) - 1 - kMargin;
      for (int x = 0; x < static_cast<int>(rows[y].size()); ++x) {
        const auto u = static_cast<std::size_t>(std::clamp(x, kMargin, last));
        result[y][static_cast<std::size_t>(x)] = std::clamp(rows[y][u] - mean[y][u] + 128, 0, 255);
      }
    }
    return result;
  }
  static Levels plane_costs(const Levels& left, const Levels& right, ImageSize size, int d) {
    // Rows above and below the image replicate the first and the last.
    Levels costs;
    for (int y = -kMargin; y < size.height + kMargin; ++y) {
      const auto row = static_cast<std::size_t>(std::clamp(y, 0, size.height - 1));
      std::vector<int> cost;
      for (int x = -kMargin; x < size.width + kMargin; ++x) {
        const bool inside = x >= d && x < size.width + d;
        const int u = std::clamp(x - d, -kMargin, size.width + kMargin - 1);
        const int difference = std::abs(left[row][static_cast<std::size_t>(x + kMargin)] -
                                        right[row][static_cast<std::size_t>(u + kMargin)]);
        cost.push_back(inside ? 8 * std::min(31, difference) : 248);
      }
      costs.push_back(cost);
    }
    return filtered_down(filtered(costs));
  }
  static int cost_at(const std::vector<Levels>& costs, std::size_t plane, int x, int y) {
    return costs[plane][static_cast<std::size_t>(y + kMargin)][static_cast<std::size_t>(x + kMargin)];
  }
  static void select(const std::vector<Levels>& costs, DisparityRange range, int x, int y, ImageSize size,
                     Found& found) {
    const auto valid = [&](int u, int plane) {
      const int d = range.min + plane;
      return plane >= 0 && plane < range.count() && u >= 0 && u < size.width && u - d >= 0 && u - d < size.width;
    };
    const auto cost = [&](int u, int plane) { return cost_at(costs, static_cast<std::size_t>(plane), u, y); };
    int best = -1;
    for (int plane = 0; plane < range.count(); ++plane) {
      if (valid(x, plane) && (best < 0 || cost(x, plane) < cost(x, best))) best = plane;
    }
    if (best < 0) {
      found.disparity(x, y) = std::numeric_limits<float>::quiet_NaN();
      found.right_distance(x, y) = 16;
      return;
    }
    const int d = range.min + best, m = x - d;
    const bool inner = valid(x, best - 1) && valid(x, best + 1);
    const float offset = inner ? equiangular_offset(cost(x, best - 1), cost(x, best), cost(x, best + 1)) : 0.0F;
    found.disparity(x, y) = static_cast<float>(d) + offset;
    int right_best = -1;
    for (int plane = 0; plane < range.count(); ++plane) {
      const int u = m + range.min + plane;
      if (!valid(u, plane)) continue;
      if (right_best < 0 || cost(u, plane) < cost(m + range.min + right_best, right_best)) right_best = plane;
    }
    found.right_distance(x, y) = static_cast<std::uint8_t>(std::min(16, std::abs(best - right_best)));
  }
};

void expect_same(const Found& found, const Found& expected) {
  int wrong = 0;
  for (int y = 0; y < expected.disparity.height(); ++y) {
    for (int x = 0; x < expected.disparity.width(); ++x) {
      const float a = found.disparity(x, y), b = expected.disparity(x, y);
      const bool same = (std::isnan(a) && std::isnan(b)) || a == b;
      if (same && found.right_distance(x, y) == expected.right_distance(x, y)) continue;
      if (++wrong < 5) {
        ADD_FAILURE() << x << ", " << y << ": " << a << " and " << b << ", distance "
                      << static_cast<int>(found.right_distance(x, y)) << " and "
                      << static_cast<int>(expected.right_distance(x, y));
      }
    }
  }
  EXPECT_EQ(wrong, 0);
}

class BlockMatching : public ::testing::TestWithParam<SimdTarget> {
 protected:
  static BlockMatcher matcher(int threads = 1) {
    return {block_kernels_for(simd_target_index(GetParam())), ThreadPool(threads)};
  }
};

TEST_P(BlockMatching, EqualsTheReference) {
  BlockMatcher matching = matcher(2);
  for (const ImageSize size : {ImageSize{70, 40}, {131, 75}, {17, 9}, {1, 1}, {40, 3}}) {
    for (const DisparityRange range :
         {DisparityRange{0, 23}, {5, 16}, {-9, 6}, {0, 0}, {-5, -1}, {-130, 130}, {60, 69}}) {
      if (range.max >= size.width || range.min <= -size.width) continue;
      SCOPED_TRACE(std::to_string(size.width) + ", " + std::to_string(range.min));
      const GrayPair pair = textured_pair(size, 7, 3);
      expect_same(match(matching, pair, range), Reference::match(pair, range));
    }
  }
}

TEST_P(BlockMatching, FindsATexturedPlaneInspiteOfAnOffset) {
  const GrayPair pair = textured_pair({160, 120}, 11, 8);
  BlockMatcher matching = matcher();
  const Found found = match(matching, pair, {0, 47});
  for (int y = 0; y < 120; ++y) {
    for (int x = 20; x < 160; ++x) {
      EXPECT_NEAR(found.disparity(x, y), 11, 0.4);
      EXPECT_EQ(found.right_distance(x, y), 0);
    }
  }
}

TEST_P(BlockMatching, IsTheSameForAnyNumberOfThreads) {
  const GrayPair pair = textured_pair({90, 200}, 5, 1);
  BlockMatcher one = matcher(1), two = matcher(2);
  expect_same(match(two, pair, {0, 31}), match(one, pair, {0, 31}));
  EXPECT_LE(static_cast<std::int64_t>(two.buffer_bytes()), BlockMatcher::memory_bytes({90, 200}, 2));
}

INSTANTIATE_TEST_SUITE_P(Simd, BlockMatching, ::testing::ValuesIn(available_simd_targets()),
                         [](const auto& test) { return std::string(name_of(test.param)); });

}  // namespace
}  // namespace spartan::internal::matching
