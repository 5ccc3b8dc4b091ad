#include "spartan/eval/disparity_metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "spartan/image_io/image_io.h"
#include "spartan/numerics/random.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using ::testing::HasSubstr;
constexpr float kHole = std::numeric_limits<float>::quiet_NaN();

Image<float> row_of(const std::vector<float>& values) {
  Image<float> image(static_cast<int>(values.size()), 1);
  std::copy(values.begin(), values.end(), image.row(0));
  return image;
}

TEST(DisparityMetrics, AgreesWithCountsByHand) {
  //                        errors:      0     0.5   0.75   1.0   1.5   2.5    4   hole  no truth
  const Image<float> truth = row_of({10.F, 10.F, 10.F, 10.F, 10.F, 10.F, 10.F, 10.F, kHole, 10.F});
  const Image<float> found = row_of({10.F, 9.5F, 10.75F, 11.F, 8.5F, 12.5F, 14.F, kHole, 3.F, 10.F});
  Image<std::uint8_t> mask(10, 1, 255);
  mask(1, 0) = mask(6, 0) = 128;
  mask(9, 0) = 0;
  const auto metrics = compare_disparities(found, truth, mask);
  ASSERT_TRUE(metrics);
  const DisparityScores& all = metrics->all;
  EXPECT_EQ(all.truth_pixels, 8);
  EXPECT_EQ(all.matched_pixels, 7);
  EXPECT_DOUBLE_EQ(*all.bad_0_5, 100.0 * 6 / 8) << "an error of exactly the threshold is not bad";
  EXPECT_DOUBLE_EQ(*all.bad_1, 100.0 * 4 / 8);
  EXPECT_DOUBLE_EQ(*all.bad_2, 100.0 * 3 / 8);
  EXPECT_DOUBLE_EQ(*all.bad_3, 100.0 * 2 / 8);
  EXPECT_DOUBLE_EQ(*all.matched_bad_1, 100.0 * 3 / 7);
  EXPECT_DOUBLE_EQ(*all.matched_bad_2, 100.0 * 2 / 7);
  EXPECT_DOUBLE_EQ(*all.density_percent, 100.0 * 7 / 8);
  EXPECT_DOUBLE_EQ(*all.rms_in_1px, std::sqrt((0.25 + 0.5625 + 1.0) / 4));
  EXPECT_DOUBLE_EQ(*all.mean_abs_px, (0.5 + 0.75 + 1 + 1.5 + 2.5 + 4) / 7);
  ASSERT_TRUE(metrics->nonocc);
  EXPECT_EQ(metrics->nonocc->truth_pixels, 6);
  EXPECT_DOUBLE_EQ(*metrics->nonocc->bad_3, 100.0 * 1 / 6);
  EXPECT_DOUBLE_EQ(*metrics->nonocc->mean_abs_px, (0.75 + 1 + 1.5 + 2.5) / 5);
}

TEST(DisparityMetrics, NonoccNeedsAMask) {
  const auto metrics = compare_disparities(row_of({1, 2, kHole}), row_of({1, kHole, 3}));
  ASSERT_TRUE(metrics);
  EXPECT_EQ(metrics->all.truth_pixels, 2);
  EXPECT_DOUBLE_EQ(*metrics->all.density_percent, 50);
  EXPECT_FALSE(metrics->nonocc);
}

TEST(DisparityMetrics, ScoresOverNoPixelsAreMissing) {
  const auto empty = compare_disparities(row_of({1, 2}), row_of({kHole, kHole}));
  ASSERT_TRUE(empty);
  EXPECT_FALSE(empty->all.bad_1);
  EXPECT_FALSE(empty->all.density_percent);
  const auto holes = compare_disparities(row_of({kHole, std::numeric_limits<float>::infinity()}), row_of({1, 2}));
  ASSERT_TRUE(holes);
  EXPECT_DOUBLE_EQ(*holes->all.bad_3, 100);
  EXPECT_DOUBLE_EQ(*holes->all.density_percent, 0);
  EXPECT_FALSE(holes->all.matched_bad_1);
  EXPECT_FALSE(holes->all.rms_in_1px);
  EXPECT_FALSE(holes->all.mean_abs_px);
}

TEST(DisparityMetrics, FailsOnDifferentSizes) {
  const auto other_truth = compare_disparities(Image<float>(3, 2), Image<float>(2, 3));
  ASSERT_FALSE(other_truth);
  EXPECT_EQ(other_truth.error().code, ErrorCode::input);
  EXPECT_THAT(other_truth.error().what, HasSubstr("2×3"));
  const Image<std::uint8_t> mask(2, 2);
  EXPECT_FALSE(compare_disparities(Image<float>(3, 2), Image<float>(3, 2), mask.view()));
}

TEST(DisparityTruth, ReadsEveryFormat) {
  const testing::TemporaryFolder folder;
  Image<std::uint8_t> eight(2, 1);
  eight(1, 0) = 90;
  Image<std::uint16_t> sixteen(2, 1);
  sixteen(1, 0) = 2600;
  Image<Rgb8> gray_rgb(2, 1);
  gray_rgb(1, 0) = {90, 90, 90};
  ASSERT_TRUE(write_png(folder.file("8.png"), eight));
  ASSERT_TRUE(write_png(folder.file("16.png"), sixteen));
  ASSERT_TRUE(write_png(folder.file("rgb.png"), gray_rgb));
  ASSERT_TRUE(write_pfm(folder.file("a.pfm"), row_of({kHole, 12.25F})));
  const auto expect = [&](const char* name, double scale, float value) {
    const auto truth = read_disparity(folder.file(name), scale);
    ASSERT_TRUE(truth) << truth.error().message();
    EXPECT_TRUE(std::isnan((*truth)(0, 0))) << name;
    EXPECT_EQ((*truth)(1, 0), value) << name;
  };
  expect("8.png", 1, 90);
  expect("8.png", 3, 30);
  expect("rgb.png", 3, 30);
  expect("16.png", 1, 10.15625F);
  expect("16.png", 3, 10.15625F);
  expect("a.pfm", 3, 12.25F);
}

TEST(DisparityTruth, RejectsOtherImages) {
  const testing::TemporaryFolder folder;
  ASSERT_TRUE(write_png(folder.file("colour.png"), Image<Rgb8>(2, 2, Rgb8{1, 2, 3})));
  EXPECT_EQ(read_disparity(folder.file("colour.png")).error().code, ErrorCode::input);
  EXPECT_EQ(read_disparity(folder.file("none.png")).error().code, ErrorCode::input);
  EXPECT_EQ(read_disparity(folder.write("text.pfm", "text")).error().code, ErrorCode::input);
  EXPECT_EQ(read_disparity(folder.file("colour.png"), 0).error().code, ErrorCode::usage);
}

TEST(DisparityTruth, MasksHaveThreeValues) {
  const testing::TemporaryFolder folder;
  Image<std::uint8_t> mask(3, 1);
  mask(1, 0) = 128;
  mask(2, 0) = 255;
  ASSERT_TRUE(write_png(folder.file("mask.png"), mask));
  const auto back = read_truth_mask(folder.file("mask.png"));
  ASSERT_TRUE(back);
  EXPECT_EQ((*back)(1, 0), 128);
  mask(0, 0) = 1;
  ASSERT_TRUE(write_png(folder.file("mask.png"), mask));
  EXPECT_THAT(read_truth_mask(folder.file("mask.png")).error().what, HasSubstr("holds 1 at (0, 0)"));
}

}  // namespace
}  // namespace spartan
