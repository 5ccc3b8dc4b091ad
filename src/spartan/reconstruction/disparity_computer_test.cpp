#include "spartan/reconstruction/disparity_computer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "spartan/numerics/random.h"
#include "spartan/numerics/simd_target.h"
#include "spartan/rig/rig.h"
#include "spartan/testing/synthetic_world.h"
#include "spartan/testing/text_checks.h"

namespace spartan {
namespace {

// A stereo pair of the synthetic ground, seen from 0.5 m above it, pitched down by 30°.
const testing::SyntheticFrame& ground() {
  static const testing::SyntheticFrame frame = [] {
    testing::SyntheticWorldOptions options;
    options.stones_per_m2 = 3;
    const Pose tilt = Pose(exp_so3({0, 30 * M_PI / 180, 0}), {0, 0, 0.5});
    return testing::SyntheticWorld(options).render({{320, 240}, 260.0, {159.5, 119.5}, 0.12},
                                                   tilt * optical_from_forward().inverse(), 1);
  }();
  return frame;
}

std::vector<float> values(ImageView<const float> image) {
  std::vector<float> all;
  for (int y = 0; y < image.height(); ++y) all.insert(all.end(), image.row(y), image.row(y) + image.width());
  return all;
}

std::vector<float> disparity_of_ground(const DisparityOptions& options, int threads, int count = 96) {
  DisparityComputer computer = DisparityComputer::create(options, ThreadPool(threads)).value();
  const auto image = computer.compute(ground().left, ground().right, {0, count - 1});
  EXPECT_TRUE(image) << image.error().message();
  return image ? values(image->disparity) : std::vector<float>{};
}

bool same_bytes(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

TEST(DisparityComputer, MatchesTheTrueDisparitiesOfASyntheticPair) {
  const std::vector<float> found = disparity_of_ground({}, 1), truth = values(ground().disparity);
  int visible = 0, known = 0, wrong = 0;
  double squares = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (std::isnan(truth[i]) || ground().mask(static_cast<int>(i % 320), static_cast<int>(i / 320)) != 255) continue;
    ++visible;
    if (std::isnan(found[i])) continue;
    ++known;
    const double error = std::abs(found[i] - truth[i]);
    if (error > 1) {
      ++wrong;
    } else {
      squares += error * error;
    }
  }
  EXPECT_GT(known, 0.97 * visible);
  EXPECT_LT(wrong, 0.02 * known) << "edges of stones";
  EXPECT_LT(std::sqrt(squares / known), 0.2) << "px";
}

TEST(DisparityComputer, IsDeterministicOnEveryInstructionSetAndNumberOfThreads) {
  for (const int count : {96, 80, 48}) {  // padded to 96, 96 and 64 bytes: vectors of 32 and of 64 bytes
    for (const MatchingMethod method : {MatchingMethod::sgm, MatchingMethod::block}) {
      DisparityOptions options;
      options.method = method;
      const std::vector<float> expected = disparity_of_ground(options, 1, count);
      EXPECT_TRUE(same_bytes(disparity_of_ground(options, 2, count), expected)) << "two threads";
      for (const SimdTarget simd : available_simd_targets()) {
        options.simd = simd;
        EXPECT_TRUE(same_bytes(disparity_of_ground(options, 1, count), expected))
            << name_of(simd) << ", " << count << " disparities";
      }
    }
  }
}

TEST(DisparityComputer, DoesNotDependOnThePreviousCall) {
  for (const MatchingMethod method : {MatchingMethod::sgm, MatchingMethod::block}) {
    DisparityOptions options;
    options.method = method;
    DisparityComputer computer = DisparityComputer::create(options, ThreadPool(1)).value();
    const auto first = values(computer.compute(ground().left, ground().right, {0, 63})->disparity);
    ASSERT_TRUE(computer.compute(ground().right, ground().left, {-40, 10}));
    const Image<std::uint8_t> small(50, 20, 90);
    ASSERT_TRUE(computer.compute(small, small, {0, 31}));
    const auto again = values(computer.compute(ground().left, ground().right, {0, 63})->disparity);
    EXPECT_TRUE(same_bytes(first, again));
  }
}

// With left and right camera swapped, disparities change their sign and nothing else.
TEST(DisparityComputer, FindsNegativeDisparities) {
  Random random(4);
  Image<std::uint8_t> left(120, 60), right(120, 60);
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 120; ++x) left(x, y) = static_cast<std::uint8_t>(random.below(256));
  }
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 120; ++x) right(x, y) = left(std::max(0, x - 7), y);  // x_left − x_right = −7
  }
  DisparityComputer computer = DisparityComputer::create(DisparityOptions{}, ThreadPool(1)).value();
  const auto image = computer.compute(left, right, {-16, 15});
  ASSERT_TRUE(image);
  for (int y = 5; y < 55; ++y) {
    for (int x = 5; x < 105; ++x) ASSERT_NEAR(image->disparity(x, y), -7, 0.25) << x << ", " << y;
  }
}

TEST(DisparityComputer, DiscardsMaskedPixels) {
  Image<std::uint8_t> mask(320, 240, 255);
  for (int y = 0; y < 240; ++y) std::fill(mask.row(y) + 100, mask.row(y) + 140, std::uint8_t{0});
  DisparityComputer computer = DisparityComputer::create(DisparityOptions{}, ThreadPool(1)).value();
  const auto image = computer.compute(ground().left, ground().right, {0, 95}, mask, {});
  ASSERT_TRUE(image);
  for (int y = 0; y < 240; ++y) {
    for (int x = 100; x < 140; ++x) ASSERT_TRUE(std::isnan(image->disparity(x, y)));
  }
}

TEST(DisparityComputer, FillsUnknownPixelsAndMarksThem) {
  Image<std::uint8_t> mask(320, 240, 255);
  for (int y = 0; y < 240; ++y) std::fill(mask.row(y) + 100, mask.row(y) + 140, std::uint8_t{0});
  DisparityOptions options;
  DisparityComputer plain = DisparityComputer::create(options, ThreadPool(1)).value();
  options.fill = true;
  DisparityComputer filling = DisparityComputer::create(options, ThreadPool(1)).value();
  const auto known = plain.compute(ground().left, ground().right, {0, 95}, mask, {});
  const auto filled = filling.compute(ground().left, ground().right, {0, 95}, mask, {});
  ASSERT_TRUE(known && filled);
  int count = 0;
  for (int y = 0; y < 240; ++y) {
    for (int x = 0; x < 320; ++x) {
      const bool masked = mask(x, y) == 0, measured = !std::isnan(known->disparity(x, y));
      ASSERT_EQ(std::isnan(filled->sigma(x, y)), !measured);
      ASSERT_EQ(std::isnan(filled->disparity(x, y)), masked) << x << ", " << y;
      if (measured) {
        ASSERT_EQ(filled->disparity(x, y), known->disparity(x, y));
      } else {
        ASSERT_EQ(filled->outlier_percent(x, y), 100);
        count += !masked;
      }
    }
  }
  EXPECT_GT(count, 0);
}

TEST(DisparityComputer, RejectsInvalidSizesAndRanges) {
  DisparityComputer computer = DisparityComputer::create(DisparityOptions{}, ThreadPool(1)).value();
  const Image<std::uint8_t> small(40, 30), other(41, 30);
  EXPECT_TRUE(DisparityComputer::check(small, small, {0, 15}));
  EXPECT_EQ(computer.compute(small, other, {0, 15}).error().code, ErrorCode::frame_rejected);
  EXPECT_EQ(computer.compute(small, small, {0, 40}).error().code, ErrorCode::frame_rejected) << "wider than the image";
  EXPECT_EQ(computer.compute(small, small, {5, 4}).error().code, ErrorCode::frame_rejected) << "empty";
  EXPECT_EQ(computer.compute({}, {}, {0, 3}).error().code, ErrorCode::frame_rejected);
  EXPECT_EQ(computer.compute(small, small, {0, 15}, other, {}).error().code, ErrorCode::frame_rejected) << "mask";
}

TEST(DisparityComputer, AcceptsTinyImages) {
  DisparityComputer computer = DisparityComputer::create(DisparityOptions{}, ThreadPool(2)).value();
  for (const int width : {1, 2, 5, 17, 33}) {
    for (const int height : {1, 2, 3, 9}) {
      const Image<std::uint8_t> image(width, height, 100);
      const auto result = computer.compute(image, image, {0, width - 1});
      ASSERT_TRUE(result) << result.error().message();
      EXPECT_EQ(result->disparity.size(), image.size());
    }
  }
}

TEST(DisparityComputer, RefusesOptionsOutOfBounds) {
  DisparityOptions options;
  options.p1 = 31;
  const auto created = DisparityComputer::create(options, ThreadPool(1));
  EXPECT_THAT(testing::error_message(created),
              ::testing::HasSubstr("disparity options: p1 is 31, must be between 0 and 30"));
}

TEST(DisparityRange, FollowsFromTheNearestDepthOrTheWidth) {
  const RectifiedStereo stereo{{640, 480}, 492.7, {319.5, 239.5}, 0.12};
  EXPECT_EQ(disparity_range(stereo, 0).count(), 176) << "a quarter of 640, rounded up";
  EXPECT_EQ(disparity_range(stereo, 0.5).count(), 128) << "118.2 px";
  EXPECT_LT(disparity_range({{40, 30}, 500, {20, 15}, 1}, 0.01).max, 40) << "never wider than the image";
}

}  // namespace
}  // namespace spartan
