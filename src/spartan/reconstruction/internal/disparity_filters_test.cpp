#include "spartan/reconstruction/internal/disparity_filters.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "spartan/numerics/random.h"
#include "spartan/numerics/simd_target.h"

namespace spartan::internal {
namespace {

constexpr float kUnknownDisparity = std::numeric_limits<float>::quiet_NaN();

// Regions of a few disparity levels with holes: components of all sizes.
Image<float> blobs(int width, int height, double holes, std::uint64_t seed) {
  Random random(seed);
  Image<float> image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double draw = random.uniform();
      image(x, y) = draw < holes ? kUnknownDisparity : static_cast<float>(random.below(3) * 3 + random.uniform());
      const bool copied = x > 0 && random.uniform() < 0.6;
      if (copied) image(x, y) = image(x - 1, y);
      if (y > 0 && random.uniform() < 0.5) image(x, y) = image(x, y - 1);
    }
  }
  return image;
}

void expect_same(ImageView<const float> found, ImageView<const float> wanted) {
  for (int y = 0; y < wanted.height(); ++y) {
    for (int x = 0; x < wanted.width(); ++x) {
      if (std::isnan(wanted(x, y))) {
        ASSERT_TRUE(std::isnan(found(x, y))) << x << ", " << y;
      } else {
        ASSERT_EQ(found(x, y), wanted(x, y)) << x << ", " << y;
      }
    }
  }
}

// Reference implementation by sorting.
Image<float> median_by_sorting(ImageView<const float> in) {
  Image<float> out(in.width(), in.height(), kUnknownDisparity);
  for (int y = 0; y < in.height(); ++y) {
    for (int x = 0; x < in.width(); ++x) {
      if (std::isnan(in(x, y))) continue;
      std::vector<float> known;
      for (int v = y - 1; v <= y + 1; ++v) {
        for (int u = x - 1; u <= x + 1; ++u) {
          const bool inside = u >= 0 && v >= 0 && u < in.width() && v < in.height();
          if (inside && !std::isnan(in(u, v))) known.push_back(in(u, v));
        }
      }
      std::sort(known.begin(), known.end());
      out(x, y) = known[(known.size() - 1) / 2];
    }
  }
  return out;
}

// Reference implementation by flood fill.
Image<float> despeckled_by_flooding(ImageView<const float> in, int size_px, double step_px) {
  Image<float> out(in.width(), in.height(), kUnknownDisparity);
  Image<std::uint8_t> seen(in.width(), in.height(), 0);
  for (int y0 = 0; y0 < in.height(); ++y0) {
    for (int x0 = 0; x0 < in.width(); ++x0) {
      if (std::isnan(in(x0, y0)) || seen(x0, y0) != 0) continue;
      std::vector<std::pair<int, int>> component{{x0, y0}};
      seen(x0, y0) = 1;
      for (std::size_t next = 0; next < component.size(); ++next) {
        const auto [x, y] = component[next];
        for (const auto& [u, v] : {std::pair(x - 1, y), {x + 1, y}, {x, y - 1}, {x, y + 1}}) {
          if (u < 0 || v < 0 || u >= in.width() || v >= in.height() || seen(u, v) != 0) continue;
          if (!(std::abs(in(u, v) - in(x, y)) <= static_cast<float>(step_px))) continue;
          seen(u, v) = 1;
          component.emplace_back(u, v);
        }
      }
      if (static_cast<int>(component.size()) < size_px) continue;
      for (const auto& [x, y] : component) out(x, y) = in(x, y);
    }
  }
  return out;
}

TEST(Median, EqualsTheReference) {
  for (const SimdTarget simd : available_simd_targets()) {
    const auto kernel = matching::refinement_kernels_for(simd_target_index(simd)).median_row;
    for (const double holes : {0.0, 0.1, 0.6}) {
      for (const ImageSize size : {ImageSize{57, 70}, {18, 5}, {1, 1}, {1, 9}, {9, 1}, {2, 2}}) {
        const Image<float> in = blobs(size.width, size.height, holes, 4);
        Image<float> out(size);
        median_3x3(in, kernel, ThreadPool(2), out);
        expect_same(out, median_by_sorting(in));
      }
    }
  }
}

TEST(SpeckleFilter, EqualsTheReference) {
  SpeckleFilter filter;
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    for (const double holes : {0.05, 0.3}) {
      Image<float> image = blobs(83, 290, holes, seed);  // several bands
      const Image<float> wanted = despeckled_by_flooding(image, 12, 1);
      filter.apply({12, 1, {}}, ThreadPool(2), image);
      expect_same(image, wanted);
    }
  }
}

TEST(SpeckleFilter, ADifferenceEqualToTheLimitConnects) {
  for (const ImageSize size : {ImageSize{4, 1}, {1, 4}}) {
    Image<float> image(size);
    for (int i = 0; i < 4; ++i)
      image(std::min(i, size.width - 1), std::min(i, size.height - 1)) = 2.0f * static_cast<float>(i);
    Image<float> kept = image.clone();
    SpeckleFilter().apply({4, 2, {}}, ThreadPool(2), kept);
    expect_same(kept, image);
    SpeckleFilter().apply({4, 1.99, {}}, ThreadPool(2), kept);
    expect_same(kept, Image<float>(size.width, size.height, kUnknownDisparity));
  }
}

TEST(SpeckleFilter, KeepsAllPixelsWhenDisabled) {
  Image<float> image(1, 1, 5.0f);
  SpeckleFilter().apply({0, 1, {}}, ThreadPool(2), image);
  EXPECT_EQ(image(0, 0), 5.0f);
}

TEST(SpeckleFilter, CountsReliablePixels) {
  Image<float> image(6, 2, kUnknownDisparity);
  Image<std::uint8_t> reliable(6, 2);
  for (int x = 0; x < 6; ++x) {
    if (x != 3) image(x, 0) = 5;  // components of three and two pixels
  }
  for (const int x : {0, 2, 4}) reliable(x, 0) = 1;
  SpeckleFilter().apply({2, 1, reliable}, ThreadPool(2), image);
  for (int x = 0; x < 6; ++x) EXPECT_EQ(std::isnan(image(x, 0)), x >= 3) << x;
}

TEST(Filling, TakesTheFartherNeighbourOfTheRow) {
  constexpr float kHole = kUnknownDisparity;
  Image<float> image(7, 3, kHole);
  const float holes[] = {kHole, 9, kHole, kHole, 4, 6, kHole}, filled[] = {9, 9, 4, 4, 4, 6, 6};
  std::copy_n(holes, 7, image.row(0));
  image(3, 2) = 5;
  fill_unknown(ThreadPool(2), image);
  for (int x = 0; x < 7; ++x) {
    EXPECT_EQ(image(x, 0), filled[x]) << x;
    EXPECT_TRUE(std::isnan(image(x, 1)));
    EXPECT_EQ(image(x, 2), 5);
  }
}

TEST(Masks, DiscardExcludedPixelsOfEitherImage) {
  Image<float> disparity(6, 1, 2.0f);
  Image<std::uint8_t> left(6, 1, std::uint8_t{255}), right(6, 1, std::uint8_t{255});
  left(5, 0) = 0;
  right(1, 0) = 0;  // the match of x = 3
  apply_masks(left, right, disparity);
  for (int x = 0; x < 6; ++x) EXPECT_EQ(std::isnan(disparity(x, 0)), x == 3 || x == 5) << x;
}

}  // namespace
}  // namespace spartan::internal
