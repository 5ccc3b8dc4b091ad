#include "spartan/odometry/internal/matching/patch_alignment.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "spartan/numerics/gradient_noise.h"
#include "spartan/numerics/random.h"
#include "spartan/odometry/internal/matching/smoothed_image.h"

namespace spartan::internal {
namespace {

constexpr int kSide = 64;

// texture(A⁻¹ (x − centre − shift)) with noise and a plane of brightness, smoothed.
class WarpedTexture {
 public:
  WarpedTexture(const Eigen::Matrix2d& warp, const Eigen::Vector2d& shift, double gain = 1, double noise = 0,
                std::uint64_t seed = 1, const Eigen::Vector2d& brightness_slope = {0, 0}) {
    const auto octaves = make_octaves(11, 2, 9, 0.7, 35);
    Image<std::uint8_t> image(kSide, kSide);
    Random random(seed);
    const Eigen::Matrix2d inverse_warp = warp.inverse();
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        const Eigen::Vector2d p = inverse_warp * (Eigen::Vector2d(x - 32, y - 32) - shift);
        double value = 120;
        for (const auto& octave : octaves) value += octave.value(p.x(), p.y());
        value = 100 + gain * (value - 120) + noise * random.normal() +
                brightness_slope.dot(Eigen::Vector2d(x - 32, y - 32));
        image(x, y) = static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0)));
      }
    }
    smooth_.compute(image, ThreadPool(1));
  }
  ImageView<const std::uint16_t> view() const { return smooth_.view(); }

 private:
  SmoothedImage smooth_;
};

AlignmentTemplate reference(double noise = 0, std::uint64_t seed = 1) {
  return AlignmentTemplate(
      *cut_patch(WarpedTexture(Eigen::Matrix2d::Identity(), {0, 0}, 1, noise, seed).view(), 32, 32));
}

TEST(SmoothedImage, IsTheBinomialFilterWithReplicatedBorders) {
  Image<std::uint8_t> image(9, 7);
  Random random(5);
  for (int y = 0; y < 7; ++y)
    for (int x = 0; x < 9; ++x) image(x, y) = static_cast<std::uint8_t>(random.below(256));
  SmoothedImage smooth;
  smooth.compute(image, ThreadPool(2));
  const int kernel[5] = {1, 4, 6, 4, 1};
  for (int y = 0; y < 7; ++y) {
    for (int x = 0; x < 9; ++x) {
      int sum = 0;
      for (int j = -2; j <= 2; ++j) {
        for (int i = -2; i <= 2; ++i)
          sum += kernel[i + 2] * kernel[j + 2] * image(std::clamp(x + i, 0, 8), std::clamp(y + j, 0, 6));
      }
      EXPECT_EQ(smooth.view()(x, y), sum);
    }
  }
  smooth.compute(Image<std::uint8_t>(1, 1, 9), ThreadPool(1));
  EXPECT_EQ(smooth.view()(0, 0), 9 * 256);
}

TEST(PatchAlignment, FindsSubPixelShiftsWithoutPixelLocking) {
  const AlignmentTemplate base = reference();
  for (const double x : {-1.3, -0.75, -0.5, -0.25, 0.0, 0.1, 0.33, 0.5, 0.8, 1.4}) {
    const Eigen::Vector2d shift(x, 0.6 * x + 0.2);
    const WarpedTexture moved(Eigen::Matrix2d::Identity(), shift);
    const auto found = align_translation(base, moved.view(), Eigen::Matrix2d::Identity(), {32, 32}, 4);
    ASSERT_TRUE(found.has_value()) << x;
    EXPECT_LT((found->position - Eigen::Vector2d(32, 32) - shift).norm(), 0.02) << x;
    EXPECT_GT(found->correlation, 0.99);
  }
}

TEST(PatchAlignment, IsInvariantToContrastAndAKnownWarp) {
  Eigen::Matrix2d warp;
  warp << 1.2, 0.05, -0.1, 1.3;
  const Eigen::Vector2d shift(0.7, -0.4);
  const WarpedTexture moved(warp, shift, 0.5);
  const auto found = align_translation(reference(), moved.view(), warp, {32, 32}, 4);
  ASSERT_TRUE(found.has_value());
  EXPECT_LT((found->position - Eigen::Vector2d(32, 32) - shift).norm(), 0.05);
}

// Shading and vignetting add planes to the brightness.
TEST(PatchAlignment, IsInvariantToPlanesOfBrightness) {
  const Eigen::Matrix2d same = Eigen::Matrix2d::Identity();
  for (const Eigen::Vector2d& slope : {Eigen::Vector2d(2, 0), Eigen::Vector2d(-1, 2)}) {
    const Eigen::Vector2d shift(0.4, -0.3);
    const WarpedTexture moved(same, shift, 1, 0, 1, slope);
    const auto found = align_translation(reference(), moved.view(), same, {32, 32}, 4);
    ASSERT_TRUE(found.has_value());
    EXPECT_LT((found->position - Eigen::Vector2d(32, 32) - shift).norm(), 0.02);
    const auto along_row =
        align_along_row(reference(), WarpedTexture(same, {-0.4, 0}, 1, 0, 1, slope).view(), {32, 32}, {}, true, 2);
    ASSERT_TRUE(along_row.has_value());
    EXPECT_NEAR(along_row->disparity, 0.4, 0.03);
  }
}

// The scale of a warp is as inexact as the slant of the surface.
TEST(PatchAlignment, IsInvariantToSmallErrorsOfScale) {
  const Eigen::Vector2d shift(0.4, -0.3);
  for (const double scale : {0.95, 1.05}) {
    const WarpedTexture moved(scale * Eigen::Matrix2d::Identity(), shift);
    const auto found = align_translation(reference(), moved.view(), Eigen::Matrix2d::Identity(), {32, 32}, 4);
    ASSERT_TRUE(found.has_value());
    EXPECT_LT((found->position - Eigen::Vector2d(32, 32) - shift).norm(), 0.02) << scale;
  }
}

TEST(PatchAlignment, CovarianceCoversTheErrors) {
  // The squared Mahalanobis distance of the error has mean 2 over many noise realizations. The correction for smoothing
  // makes the covariance conservative: 0.3 … 1.2 times that.
  double sum = 0;
  const int trials = 200;
  for (int i = 0; i < trials; ++i) {
    const auto seed = static_cast<std::uint64_t>(i);
    const Eigen::Vector2d shift(0.01 * i - 1, 0.3);
    const WarpedTexture moved(Eigen::Matrix2d::Identity(), shift, 1, 4, 2 * seed + 1);
    const auto found =
        align_translation(reference(4, 2 * seed), moved.view(), Eigen::Matrix2d::Identity(), {32, 32}, 4);
    ASSERT_TRUE(found.has_value());
    const Eigen::Vector2d error = found->position - Eigen::Vector2d(32, 32) - shift;
    sum += error.dot(found->covariance.inverse() * error);
  }
  EXPECT_GT(sum / trials / 2, 0.3);
  EXPECT_LT(sum / trials / 2, 1.2);
}

TEST(PatchAlignment, FindsDisparityAndSlant) {
  // right(x) = left(x + d + s·offset): the warp from left to right offsets is (1 − s_x, −s_y; 0, 1).
  const Eigen::Vector2d slant(0.05, 0.3);
  Eigen::Matrix2d warp;
  warp << 1 - slant.x(), -slant.y(), 0, 1;
  for (const double d : {-0.8, -0.3, 0.0, 0.45, 1.0}) {
    const WarpedTexture right(warp, {-d, 0});
    RowAlignment start;
    const auto found = align_along_row(reference(), right.view(), {32, 32}, start, true, 2);
    ASSERT_TRUE(found.has_value()) << d;
    EXPECT_NEAR(found->disparity, d, 0.04) << d;
    EXPECT_NEAR(found->slant.x(), slant.x(), 0.03);
    EXPECT_NEAR(found->slant.y(), slant.y(), 0.03);
    const auto fronto_parallel = align_along_row(reference(), right.view(), {32, 32}, start, false, 2);
    if (fronto_parallel) {
      EXPECT_LT(fronto_parallel->correlation, found->correlation);
    }
  }
}

// As along the row, with the row unknown as well.
TEST(PatchAlignment, FindsPositionAndSlant) {
  const Eigen::Vector2d slant(0.05, 0.3);
  Eigen::Matrix2d warp;
  warp << 1 - slant.x(), -slant.y(), 0, 1;
  for (const double d : {-0.8, -0.3, 0.0, 0.45, 1.0}) {
    const Eigen::Vector2d shift(-d, 0.4 * d + 0.3);
    const WarpedTexture right(warp, shift);
    const auto found = align_slanted(reference(), right.view(), {32, 32}, 3);
    ASSERT_TRUE(found.has_value()) << d;
    EXPECT_LT((found->match.position - Eigen::Vector2d(32, 32) - shift).norm(), 0.05) << d;
    EXPECT_NEAR(found->slant.x(), slant.x(), 0.03);
    EXPECT_NEAR(found->slant.y(), slant.y(), 0.03);
    const auto fronto_parallel = align_translation(reference(), right.view(), Eigen::Matrix2d::Identity(), {32, 32}, 3);
    if (fronto_parallel) {
      EXPECT_LT(fronto_parallel->correlation, found->match.correlation);
    }
  }
  EXPECT_FALSE(align_slanted(reference(), WarpedTexture(Eigen::Matrix2d::Identity(), {3, 3}).view(), {32, 32}, 1));
}

TEST(PatchAlignment, RejectsBordersFlatPatchesAndLargeSteps) {
  const WarpedTexture texture(Eigen::Matrix2d::Identity(), {0, 0});
  EXPECT_FALSE(cut_patch(texture.view(), 6, 32).has_value());
  EXPECT_TRUE(cut_patch(texture.view(), 7, 56).has_value());
  EXPECT_FALSE(cut_patch(texture.view(), 32, 57).has_value());
  const Eigen::Matrix2d same = Eigen::Matrix2d::Identity();
  EXPECT_FALSE(align_translation(reference(), texture.view(), same, {3, 32}, 4).has_value());
  EXPECT_FALSE(align_translation(reference(), texture.view(), same, {1e9, 32}, 4).has_value());
  EXPECT_FALSE(align_translation(reference(), texture.view(), same, {std::nan(""), 32}, 4).has_value());
  ImagePatch flat;
  flat.fill(100 * 256);
  EXPECT_FALSE(align_translation(AlignmentTemplate(flat), texture.view(), same, {32, 32}, 4).has_value());
  const WarpedTexture moved(same, {1.5, 0});
  EXPECT_FALSE(align_translation(reference(), moved.view(), same, {32, 32}, 0.5).has_value());
}

}  // namespace
}  // namespace spartan::internal
